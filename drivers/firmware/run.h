/* What does a run do: samples out and in on one clock, the ramp to a level, the watchdog?
 *
 * Sample k is read, then put out. An empty output FIFO ends the run, since a rig with memory cannot wait. Of the input
 * the last INPUT_FIFO samples are kept, sent or not; one that is overwritten before it was sent is an overrun.
 */
#ifndef RUN_H
#define RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"

enum state { IDLE, ARMED, RUNNING, RAMPING };
enum condition { OVERRUN = 1, UNDERRUN = 2, WATCHDOG = 4, GAP = 8 };

struct ramp {
    int16_t level;
    uint16_t ms;
};

/* Go on after a reset: an output that was in use is brought to its safe level. */
void run_wake(void);

/* Clear the FIFOs and take `total` samples at CLOCK_HZ / divider; `safe` is where to go when something fails. */
void run_arm(uint32_t total, uint32_t divider, struct ramp safe);

/* Start the sample clock; false unless armed. */
bool run_go(void);

/* Stop it; the output holds its level. */
void run_halt(void);

/* Stop it and ramp to a level, from now on the safe one. */
void run_safe(struct ramp safe);

/* Do what is due: a step of the ramp, the end of a run that failed, the watchdog. */
void run_watch(void);

/* Note that the host is alive. */
void run_heard(void);

/* Return for how long it has been silent, in ms. */
uint32_t run_silent_ms(void);

/* Open the output FIFO for `count` samples numbered from `start`; false when they do not follow, or do not fit. */
bool run_open(uint32_t start, uint16_t count);

/* Put the next of them behind those accepted; false when it is no code. It counts from run_accept on. */
bool run_put(int16_t code);

/* Accept what was put. */
void run_accept(void);

/* Return the sample `number` of the input, which must be one of the last INPUT_FIFO. */
int16_t run_input(uint32_t number);

enum state run_state(void);
bool run_level(int16_t *level);
uint32_t run_accepted(void);
uint32_t run_played(void);

/* Return what befell the run; a gap is told once. */
uint8_t run_take_conditions(void);
void run_mark(enum condition what);

/* Called by the board's interrupts: a period of the sample clock is over; the input was read. */
void run_tick(void);
void run_converted(int16_t code);

#endif
