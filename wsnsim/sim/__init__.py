"""Where all parts meet: nodes with programs, cameras and batteries on one network and one clock."""
