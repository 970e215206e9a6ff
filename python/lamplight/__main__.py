"""`python3 -m lamplight` is `lamplight`."""

from lamplight._programs import main

main()
