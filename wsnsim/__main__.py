"""`python -m wsnsim` is the `wsnsim` command."""

from wsnsim.cli.main import main

if __name__ == "__main__":
    main()
