# What is compiled: the ATmega2560 image and the two makes of the simulated fleet. Called by the Makefile, which has
# generated the protocol before; sources are found, header dependencies are recorded, only what changed is redone.

include scripts/options.mk

ALL_SOURCES = $(shell find $(1) -name '$(2)' 2>/dev/null | LC_ALL=C sort)

.DELETE_ON_ERROR:
.SUFFIXES:
.PHONY: firmware plant-avr plant-native plant-null
firmware: build/firmware/firmware.hex
	@echo 'firmware: $<'
	@scripts/size build/firmware/firmware.elf $(FLASH_BUDGET) $(RAM_BUDGET) build/firmware/size.json
plant-avr: build/lib/libshoal_plant_avr.so
plant-native: build/lib/libshoal_plant_native.so
plant-null: build/lib/libshoal_plant_null.so

SHOW = @printf '  %-8s %s\n' $(1) $(2)
MAKE_DIRECTORY = @mkdir -p $(@D)

# --- the image -------------------------------------------------------------------------------------------------------

ARDUINO ?= /usr/share/arduino/hardware/arduino/avr
ARDUINO_JSON ?= $(firstword $(wildcard $(HOME)/Arduino/libraries/ArduinoJson/src))
CORE := $(ARDUINO)/cores/arduino
LIBRARIES := Wire SPI EEPROM
CORE_DIRECTORIES := $(CORE) $(ARDUINO)/variants/mega \
	$(foreach library,$(LIBRARIES),$(ARDUINO)/libraries/$(library)/src) $(ARDUINO_JSON)

AVR := -mmcu=atmega2560 -mrelax -DF_CPU=16000000L -DARDUINO=10819 -DARDUINO_AVR_MEGA2560 -DARDUINO_ARCH_AVR \
	$(addprefix -I,$(CORE_DIRECTORIES)) -g -Os -flto -ffunction-sections -fdata-sections -MMD -MP $(FIRMWARE_DEFINES)
# The Arduino core of Debian does not compile without the last one.
AVR_CXX := $(AVR) -fno-exceptions -fno-threadsafe-statics -DDECIMAL_DIG=__DECIMAL_DIG__

FIRMWARE_SOURCES := $(call ALL_SOURCES,firmware,*.ino) $(call ALL_SOURCES,firmware/src,*.cpp)
CORE_SOURCES := $(foreach directory,$(filter-out $(ARDUINO_JSON),$(CORE_DIRECTORIES)),\
	$(foreach kind,*.c *.cpp *.S,$(call ALL_SOURCES,$(directory),$(kind))))

FIRMWARE_OBJECTS := $(FIRMWARE_SOURCES:%=build/firmware/%.o)
CORE_OBJECTS := $(CORE_SOURCES:$(ARDUINO)/%=build/firmware/arduino/%.o)

build/firmware/firmware/%.cpp.o: firmware/%.cpp $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	$(call SHOW,avr-g++,$<)
	@avr-g++ $(AVR_CXX) -std=gnu++14 $(WARNINGS) -c $< -o $@

build/firmware/firmware/%.ino.o: firmware/%.ino $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	$(call SHOW,avr-g++,$<)
	@avr-g++ $(AVR_CXX) -std=gnu++14 $(WARNINGS) -x c++ -include Arduino.h -c $< -o $@

build/firmware/arduino/%.cpp.o: $(ARDUINO)/%.cpp $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	@avr-g++ $(AVR_CXX) -std=gnu++11 -w -fpermissive -c $< -o $@

build/firmware/arduino/%.c.o: $(ARDUINO)/%.c $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	@avr-gcc $(AVR) -std=gnu11 -w -c $< -o $@

build/firmware/arduino/%.S.o: $(ARDUINO)/%.S $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	@avr-gcc $(AVR) -x assembler-with-cpp -c $< -o $@

build/firmware/core.a: $(CORE_OBJECTS)
	@rm -f $@
	$(call SHOW,avr-ar,"$@ (Arduino core)")
	@avr-gcc-ar rcs $@ $^

build/firmware/firmware.elf: $(FIRMWARE_OBJECTS) build/firmware/core.a
	$(call SHOW,link,$@)
	@avr-g++ -mmcu=atmega2560 -mrelax -g -Os -flto -fuse-linker-plugin -Wl,--gc-sections $^ -lm -o $@

build/firmware/firmware.hex: build/firmware/firmware.elf
	@avr-objcopy -O ihex -R .eeprom $< $@

# --- the companion's auction, beside its Python -------------------------------------------------------------------------

KERNEL := companion/formation/libkernel.so
KERNEL_FLAGS := -O3 -fPIC -shared -std=c11 -ffp-contract=off $(WARNINGS)
KERNEL_CHECK := companion/formation/kernel.c tests/companion/formation/kernel_check.c
.PHONY: kernel kernel-armhf
kernel: $(KERNEL)

# The same cases on this machine and on the vehicle's processor must end in the same bytes.
kernel-armhf: $(KERNEL_CHECK)
	@mkdir -p build/armhf
	$(call SHOW,cc,build/armhf/host)
	@$(CC) -O3 -std=c11 -ffp-contract=off $(WARNINGS) $^ -o build/armhf/host -lm
	$(call SHOW,armv7,build/armhf/libkernel.so)
	@arm-linux-gnueabihf-gcc $(KERNEL_FLAGS) -march=armv7-a -mfpu=neon companion/formation/kernel.c \
		-o build/armhf/libkernel.so -lm
	@arm-linux-gnueabihf-gcc -O3 -std=c11 -ffp-contract=off $(WARNINGS) -march=armv7-a -mfpu=neon -static $^ \
		-o build/armhf/vehicle -lm
	@build/armhf/host >build/armhf/host.out
	@qemu-arm build/armhf/vehicle >build/armhf/vehicle.out
	@cmp build/armhf/host.out build/armhf/vehicle.out
	@echo "kernel-armhf: $$(wc -l <build/armhf/host.out) auctions end in the same bytes on armv7"

$(KERNEL): companion/formation/kernel.c $(MAKEFILE_LIST)
	$(call SHOW,cc,$@)
	@$(CC) $(KERNEL_FLAGS) $< -o $@ -lm

# --- the simulated fleet, once round simavr (GPLv3) and once round the firmware's own sources ------------------------

HOST := -g -O2 -fPIC -ffp-contract=off -pthread -MMD -MP -I. $(WARNINGS)
SHARED_SOURCES := $(wildcard sim/plant/*.c sim/mcu/*.c sim/mcu/chips/*.c)
AVR_MAKE_SOURCES := $(SHARED_SOURCES) $(wildcard sim/mcu/avr/*.c)
NATIVE_MAKE_SOURCES := $(SHARED_SOURCES) $(wildcard sim/mcu/native/*.c sim/mcu/native/*.cpp) \
	$(filter-out %/board_mega.cpp,$(call ALL_SOURCES,firmware/src,*.cpp))

# Hull and sensors without firmware, for work on them alone.
NULL_MAKE_SOURCES := $(wildcard sim/plant/*.c sim/plant/null/*.c)

build/host/%.c.o: %.c $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	$(call SHOW,cc,$<)
	@$(CC) $(HOST) -std=gnu11 -c $< -o $@

build/host/%.cpp.o: %.cpp $(MAKEFILE_LIST)
	$(MAKE_DIRECTORY)
	$(call SHOW,c++,$<)
	@$(CXX) $(HOST) -std=gnu++14 -fno-exceptions $(FIRMWARE_DEFINES) -c $< -o $@

build/lib/libshoal_plant_avr.so: $(AVR_MAKE_SOURCES:%=build/host/%.o)
	$(MAKE_DIRECTORY)
	$(call SHOW,link,$@)
	@$(CC) -shared -pthread -Wl,--no-undefined $^ -lsimavr -lelf -lm -o $@

build/lib/libshoal_plant_native.so: $(NATIVE_MAKE_SOURCES:%=build/host/%.o)
	$(MAKE_DIRECTORY)
	$(call SHOW,link,$@)
	@$(CXX) -shared -pthread -Wl,--no-undefined $^ -lm -o $@

build/lib/libshoal_plant_null.so: $(NULL_MAKE_SOURCES:%=build/host/%.o)
	$(MAKE_DIRECTORY)
	$(call SHOW,link,$@)
	@$(CC) -shared -pthread -Wl,--no-undefined $^ -lm -o $@

-include $(shell find build -name '*.d' 2>/dev/null)
