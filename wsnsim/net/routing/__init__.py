"""Which way frames go: the quality of links, trees, and how they are found."""
