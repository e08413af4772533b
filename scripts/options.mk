# Budgets and options of the build, each declared here and nowhere else.

# Bytes of the ATmega2560's 256 KiB flash and 8 KiB RAM that the image may use; RAM without stack.
FLASH_BUDGET := 49152
RAM_BUDGET := 4096

# More macros for the firmware, such as -DSHOAL_COMPANION_BAUD=250000UL; 'make clean' after a change.
FIRMWARE_DEFINES ?=

WARNINGS := -Wall -Wextra -Werror
