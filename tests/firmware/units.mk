# Builds the firmware's unit tests for the host with sanitizers, from the project's root: make -f tests/firmware/units.mk
OUT := build/tests/firmware
FLAGS := -g -O1 -Wall -Wextra -Werror -Wdouble-promotion -fsanitize=address,undefined -fno-sanitize-recover=all \
	-ffp-contract=off -MMD -MP -I.

SOURCES := $(filter-out %/board_mega.cpp,$(shell find firmware/src -name '*.cpp')) $(wildcard tests/firmware/*.cpp)
CHIPS := $(wildcard sim/mcu/chips/*.c)
OBJECTS := $(SOURCES:%=$(OUT)/%.o) $(CHIPS:%=$(OUT)/%.o)

$(OUT)/units: $(OBJECTS)
	@$(CXX) -fsanitize=address,undefined $^ -lm -o $@

$(OUT)/tests/%.cpp.o: tests/%.cpp tests/firmware/units.mk
	@mkdir -p $(@D)
	@$(CXX) $(filter-out -Wdouble-promotion,$(FLAGS)) -std=gnu++14 -c $< -o $@

$(OUT)/%.cpp.o: %.cpp tests/firmware/units.mk
	@mkdir -p $(@D)
	@$(CXX) $(FLAGS) -std=gnu++14 -c $< -o $@

$(OUT)/%.c.o: %.c tests/firmware/units.mk
	@mkdir -p $(@D)
	@$(CC) $(filter-out -Wdouble-promotion,$(FLAGS)) -std=gnu11 -c $< -o $@

-include $(shell find $(OUT) -name '*.d' 2>/dev/null)
