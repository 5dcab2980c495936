"""Lets ``python -m tetsimplify`` do what the console script does."""

from tetsimplify.cli import main

if __name__ == "__main__":
    main()
