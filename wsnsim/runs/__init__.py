"""One run as a user sees it: a scenario goes in, a folder of results comes out."""
