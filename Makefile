# Every step of working with Shoal; each does its own set-up. Without a target, make lists them.

SHELL := /bin/sh
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

ARGS ?=
PYTHON := .venv/bin/python
BUILD = $(MAKE) -s -f scripts/build.mk $(if $(findstring jobserver,$(MAKEFLAGS)),,-j$(shell nproc))
MCU = $(shell scripts/setup mcu)

C_FILES = $(shell git ls-files --cached --others --exclude-standard '*.c' '*.cpp' '*.h' '*.ino')

.PHONY: help
help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))

# --- set-up ----------------------------------------------------------------------------------------------------------

.PHONY: setup
setup: .venv/stamp ## install what is missing: Debian packages, then .venv with pinned versions (4 minutes at first)

.PHONY: host
host:
	@scripts/setup build

.venv/stamp: requirements.txt pyproject.toml | host
	@echo 'setup: Python packages into .venv (1 to 2 minutes)'
	@[ -x $(PYTHON) ] && $(PYTHON) -c '' 2>/dev/null || python3 -m venv --clear .venv
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check -r requirements.txt
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
		--config-settings editable_mode=compat -e .
	@touch $@

.PHONY: protocol
protocol: protocol/generated/__init__.py ## generate the messages for C and Python (1 second)

protocol/generated/__init__.py: protocol/dialect.toml protocol/private.xml protocol/generate.py .venv/stamp
	@$(PYTHON) protocol/generate.py
	@touch $@

# --- what is built ---------------------------------------------------------------------------------------------------

.PHONY: firmware
firmware: protocol ## build the ATmega2560 image, print flash and RAM against their budgets (20 seconds)
	@scripts/setup avr
	@echo 'firmware: the ATmega2560 image (20 seconds from scratch)'
	+@$(BUILD) firmware

.PHONY: sketch
sketch: protocol ## prove with arduino-builder that firmware/ is a valid Arduino sketch (30 seconds)
	@scripts/setup sketch
	@echo 'sketch: compiling firmware/ as Arduino would (30 seconds)'
	@scripts/sketch

.PHONY: kernel
kernel: protocol ## compile the auction of the formation for this machine (1 second)
	+@$(BUILD) kernel

.PHONY: kernel-armhf
kernel-armhf: ## compile it for the vehicle's armv7 too, and compare the answers under qemu (20 seconds)
	@scripts/setup armhf
	+@$(BUILD) kernel-armhf

.PHONY: plant
plant: kernel ## build the image and the simulated fleet, round simavr and natively (40 seconds)
	@echo 'plant: image and simulated fleet (40 seconds from scratch)'
	+@if [ "$$(scripts/setup mcu)" = avr ]; \
		then $(BUILD) firmware plant-avr plant-native plant-null; else $(BUILD) plant-native plant-null; fi

# --- what is run -----------------------------------------------------------------------------------------------------

.PHONY: demo
demo: plant ## six vehicles form a triangle and travel a path (2 minutes; ARGS=--headless without the page)
	@echo "demo: six vehicles, $(MCU) make of the microcontroller (2 minutes)"
	@.venv/bin/shoal-sim run demo --mcu $(MCU) $(ARGS)

.PHONY: test
test: plant ## run all tests (under 10 minutes; ARGS='-k link' for some)
	@scripts/setup test
	@echo 'test: the whole suite, simulated vehicles included (under 10 minutes)'
	@$(PYTHON) -m pytest -n 2 --dist loadfile $(ARGS)

.PHONY: lint
lint: protocol ## check style and types: ruff, mypy, clang-format, cppcheck (1 minute)
	@scripts/setup lint
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy
	@echo clang-format
	@clang-format --dry-run -Werror $(C_FILES)
	@echo cppcheck
	@scripts/cppcheck

.PHONY: bench
bench: plant ## measure how much faster than real time the simulator is, and why not more (2 minutes)
	@echo 'bench: speed of the simulator on both makes (2 minutes)'
	@.venv/bin/shoal-sim bench $(ARGS)

.PHONY: campaign
campaign: plant ## run the campaigns that the documentation quotes (hours; ARGS='swarm --seeds 20' for a taste)
	@.venv/bin/shoal-sim campaign $(or $(ARGS),all)

.PHONY: docs
docs: protocol ## write the reference of messages, parameters and files into build/docs, and docs/hull.md (20 seconds)
	@$(PYTHON) scripts/document.py build/docs
	@$(BUILD) plant-null
	@$(PYTHON) -m sim.plant.manoeuvres

.PHONY: flash
flash: firmware ## write the image into a board: make flash PORT=/dev/ttyUSB0 (10 seconds)
	@scripts/setup flash
	@[ -n '$(PORT)' ] || { echo 'flash: name the serial port: make flash PORT=/dev/ttyUSB0' >&2; exit 2; }
	avrdude -p atmega2560 -c wiring -P '$(PORT)' -b 115200 -D -U flash:w:build/firmware/firmware.hex:i

.PHONY: clean
clean: ## remove everything that was built; .venv stays
	rm -rf build protocol/generated firmware/src/link/dialect companion/formation/libkernel.so
