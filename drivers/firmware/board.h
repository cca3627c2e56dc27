/* What must a board provide, so that the rest of the firmware runs on it unchanged?
 *
 * A board is one folder: settings.h says what is soldered in, board.c drives it. Interrupts call run_tick and
 * run_converted; everything else here is called from the main loop or from those two.
 */
#ifndef BOARD_H
#define BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "settings.h"

/* Set ports, clocks and converters up; nothing is put out. */
void board_start(void);

/* Take the next byte that arrived; false when there is none. */
bool board_receive(uint8_t *byte);

/* Return whether the queue takes one more byte to send. */
bool board_room(void);

/* Queue a byte to be sent; there must be room. */
void board_send(uint8_t byte);

/* Start the sample clock, CLOCK_HZ / divider: run_tick is called once a period. */
void board_clock_start(uint32_t divider);

/* Stop it; when this returns no conversion is under way and none will be told. */
void board_clock_stop(void);

/* Begin to read the input; returns when the input is held, so that the output may move. run_converted follows. */
void board_read_input(void);

/* Put out a level, a code of the DAC: -OUTPUT_TOP to OUTPUT_TOP. */
void board_write_output(int16_t code);

/* Return the time since the start in ms; runs over after 49 days. */
uint32_t board_ms(void);

/* Show whether the sample clock runs. */
void board_lamp(bool on);

/* Tell the hardware watchdog that the main loop is alive. */
void board_alive(void);

/* Sleep until something happens. */
void board_rest(void);

/* Keep interrupts off between the two; they do not nest. */
uint8_t board_lock(void);
void board_unlock(uint8_t before);

#endif
