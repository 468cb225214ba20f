"""`python -m mavquad`."""

from mavquad.cli import main

if __name__ == "__main__":
    main()
