"""Medium access: who may send when. One MAC, one file."""
