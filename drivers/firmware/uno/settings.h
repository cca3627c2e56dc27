/* What is soldered to an Arduino Uno or Nano (ATmega328P, 16 MHz): its converters, their scaling, its memory?
 *
 * Output: MCP4921 or channel A of an MCP4922 (12 bits, SPI) on a 4.096 V reference, an amplifier behind it makes
 * 2.048 V +- 2.048 V into 0 V +- 10 V. Input: ADC0 (10 bits) on the 5 V supply, a divider in front of it makes
 * 0 V +- 12.5 V into 2.5 V +- 2.5 V. Change the ranges here when your resistors differ: the host asks for them.
 */
#ifndef SETTINGS_H
#define SETTINGS_H

#include <avr/pgmspace.h>

#define MODEL "rig DAQ on ATmega328P"
#define VERSION "1"
#ifndef SERIAL_NUMBER
#define SERIAL_NUMBER "1"
#endif
#ifndef BAUD
#define BAUD 500000
#endif

#define OUTPUT_BITS 12
#define OUTPUT_TOP 2047
#define OUTPUT_LOW_V -10.0
#define OUTPUT_HIGH_V 10.0
#define INPUTS 1
#define INPUT_BITS 10
#define INPUT_TOP 511
#define INPUT_LOW_V -12.5
#define INPUT_HIGH_V 12.5

/* Timer 1 counts the processor's clock divided by 8, and has 16 bits. */
#define CLOCK_HZ 2000000
#define LEAST_DIVIDER 400
#define MOST_DIVIDER 65535
#define MIN_RATE_HZ 31
#define MAX_RATE_HZ 5000

/* Samples of two bytes each, in 2 kB of memory. INPUT_FIFO is a power of two. */
#define OUTPUT_FIFO 384
#define INPUT_FIFO 256

#define WATCHDOG_MS 2000
#define WATCHDOG_S 2.0

/* Constants live in flash: they would take their place in memory too. */
#define FLASH PROGMEM
#define flash_byte(address) pgm_read_byte(address)
#define flash_word(address) pgm_read_dword(address)

/* Memory that a reset leaves alone. */
#define KEPT __attribute__((section(".noinit")))

#endif
