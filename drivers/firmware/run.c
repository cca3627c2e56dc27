#include "run.h"

#define IN_USE 0x52494721UL

static volatile uint8_t state, conditions;
static uint32_t total, divider, accepted, heard_ms, ramp_start_ms;
static volatile uint32_t played;
static int16_t ramp_first;

static int16_t output[OUTPUT_FIFO], input[INPUT_FIFO];
static volatile uint16_t stored; /* accepted and not played */
static uint16_t next_in, next_out, put_at, put_count, skipped;

/* The level at the output and where it is safe outlive a reset, which the host's opening of the port may be. */
static KEPT struct {
    uint32_t mark;
    int16_t level;
    struct ramp safe;
    uint32_t check;
} kept;

static uint32_t kept_check(void)
{
    return ~(IN_USE ^ (uint32_t)(uint16_t)kept.safe.level << 16 ^ kept.safe.ms);
}

static bool level_known(void)
{
    return kept.mark == IN_USE;
}

static void level_put(int16_t level)
{
    board_write_output(level);
    kept.level = level;
    kept.mark = IN_USE;
}

static void safe_is(struct ramp safe)
{
    kept.safe = safe;
    kept.check = kept_check();
}

static void clock_stop(void)
{
    board_clock_stop();
    board_lamp(false);
}

/* One step of the ramp; its length in ms was checked when it was asked for. */
static void ramp_step(void)
{
    uint32_t elapsed = board_ms() - ramp_start_ms;
    if (elapsed >= kept.safe.ms) {
        level_put(kept.safe.level);
        state = IDLE;
    } else {
        int32_t rise = (int32_t)kept.safe.level - ramp_first;
        level_put((int16_t)(ramp_first + rise * (int32_t)elapsed / (int32_t)kept.safe.ms));
    }
}

static void ramp_begin(struct ramp to)
{
    ramp_first = level_known() ? kept.level : to.level;
    ramp_start_ms = board_ms();
    safe_is(to);
    state = RAMPING;
    ramp_step();
}

void run_wake(void)
{
    bool sound = level_known() && kept.check == kept_check() && kept.level >= -OUTPUT_TOP && kept.level <= OUTPUT_TOP
        && kept.safe.level >= -OUTPUT_TOP && kept.safe.level <= OUTPUT_TOP;
    if (sound) {
        ramp_begin(kept.safe);
    } else {
        kept.mark = 0;
        safe_is((struct ramp){0, 0});
    }
}

void run_arm(uint32_t samples, uint32_t clocks, struct ramp safe)
{
    clock_stop();
    total = samples;
    divider = clocks;
    safe_is(safe);
    accepted = played = 0;
    stored = next_in = next_out = put_count = 0;
    conditions = 0;
    state = ARMED;
}

bool run_go(void)
{
    if (state != ARMED)
        return false;
    run_heard();
    state = RUNNING;
    if (total) {
        board_lamp(true);
        board_clock_start(divider);
    }
    return true;
}

void run_halt(void)
{
    run_watch();
    clock_stop();
    if (state == RUNNING || state == ARMED)
        state = IDLE;
}

void run_safe(struct ramp safe)
{
    clock_stop();
    ramp_begin(safe);
}

static bool at_rest(void)
{
    return state == RAMPING || (state == IDLE && (!level_known() || kept.level == kept.safe.level));
}

void run_watch(void)
{
    if (state == RUNNING && (conditions & UNDERRUN))
        run_safe(kept.safe);
    if (!at_rest() && run_silent_ms() > WATCHDOG_MS) {
        run_mark(WATCHDOG);
        run_safe(kept.safe);
    }
    if (state == RAMPING)
        ramp_step();
}

void run_heard(void)
{
    heard_ms = board_ms();
}

uint32_t run_silent_ms(void)
{
    return board_ms() - heard_ms;
}

bool run_open(uint32_t start, uint16_t count)
{
    put_at = next_in;
    put_count = skipped = 0;
    if (start > accepted || (state != ARMED && state != RUNNING))
        return false;
    uint32_t known = accepted - start;
    skipped = known < count ? (uint16_t)known : count;
    uint8_t before = board_lock();
    uint16_t room = OUTPUT_FIFO - stored;
    board_unlock(before);
    return count - skipped <= room;
}

bool run_put(int16_t code)
{
    if (skipped) { /* accepted before, so a repeated frame does no harm */
        skipped--;
        return true;
    }
    if (code < -OUTPUT_TOP || code > OUTPUT_TOP)
        return false;
    output[put_at] = code;
    put_at = put_at + 1 == OUTPUT_FIFO ? 0 : put_at + 1;
    put_count++;
    return true;
}

void run_accept(void)
{
    uint8_t before = board_lock();
    stored += put_count;
    board_unlock(before);
    accepted += put_count;
    next_in = put_at;
    put_count = 0;
}

int16_t run_input(uint32_t number)
{
    uint8_t before = board_lock();
    int16_t code = input[number % INPUT_FIFO];
    board_unlock(before);
    return code;
}

enum state run_state(void)
{
    return state;
}

bool run_level(int16_t *level)
{
    uint8_t before = board_lock();
    *level = kept.level;
    board_unlock(before);
    return level_known();
}

uint32_t run_accepted(void)
{
    return accepted;
}

uint32_t run_played(void)
{
    uint8_t before = board_lock();
    uint32_t now = played;
    board_unlock(before);
    return now;
}

uint8_t run_take_conditions(void)
{
    uint8_t before = board_lock();
    uint8_t now = conditions;
    conditions &= (uint8_t)~GAP;
    board_unlock(before);
    return now;
}

void run_mark(enum condition what)
{
    uint8_t before = board_lock();
    conditions |= what;
    board_unlock(before);
}

void run_tick(void)
{
    if (!stored) { /* the ramp is begun by run_watch, outside the interrupt */
        conditions |= UNDERRUN;
        clock_stop();
        return;
    }
    board_read_input();
    level_put(output[next_out]);
    next_out = next_out + 1 == OUTPUT_FIFO ? 0 : next_out + 1;
    stored--;
}

void run_converted(int16_t code)
{
    input[played % INPUT_FIFO] = code;
    played++;
    if (played == total)
        clock_stop();
}
