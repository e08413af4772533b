// Which pin and which timer carries what on the Arduino Mega 2560; the simulator wires its models by the same lines.
#pragma once

#define SHOAL_CPU_HZ 16000000UL

// Servos and ESC: fast PWM with ICR as top, 50 Hz, 0.5 us a step.
#define SHOAL_PIN_BOW 5    // PE3, OC3A
#define SHOAL_PIN_STERN 2  // PE4, OC3B
#define SHOAL_PIN_MOTOR 6  // PH3, OC4A

// SPI: MISO 50 (PB3), MOSI 51 (PB2), SCK 52 (PB1); SS 53 (PB0) stays an output.
#define SHOAL_PIN_IMU_SELECT 22  // PA0, low selects

// I2C: SDA 20 (PD1), SCL 21 (PD0).
#define SHOAL_PIN_LEAK 23  // PA1, pulled up, water pulls it low
#define SHOAL_PIN_LED 13   // PB7

#define SHOAL_ANALOG_BATTERY_VOLTAGE 0  // A0 through a divider
#define SHOAL_ANALOG_BATTERY_CURRENT 1  // A1 from a shunt amplifier

// The power module's scale: volts and amperes at the battery per volt at the pin.
#define SHOAL_BATTERY_VOLTS_PER_VOLT 3.0f
#define SHOAL_BATTERY_AMPS_PER_VOLT 10.0f

// USART0: console over the USB bridge. USART1: companion, TX 18 (PD3), RX 19 (PD2).
#ifndef SHOAL_COMPANION_BAUD
#define SHOAL_COMPANION_BAUD 115200UL
#endif
#ifndef SHOAL_CONSOLE_BAUD
#define SHOAL_CONSOLE_BAUD 115200UL
#endif
