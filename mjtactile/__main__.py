"""`python -m mjtactile`: the command line."""

from mjtactile.cli.main import main

if __name__ == "__main__":
    main()
