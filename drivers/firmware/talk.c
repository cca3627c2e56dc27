#include "talk.h"

#include "board.h"
#include "crc.h"
#include "frames.h"
#include "run.h"
#include "text.h"

#define BEAT_MS 10
#define SAMPLES 32  /* in a frame at most */
#define MARGIN 32   /* samples that may be overwritten while a frame is on its way */
#define TURN 16     /* bytes at once, lest those that arrive meanwhile are lost */
#define WAITING 8   /* ranges asked for again, remembered at most */
#define LONGEST_RAMP_MS 60000

#define QUOTED(value) #value
#define TEXT(value) QUOTED(value)

static const char WHO[] FLASH = "OK\nprotocol=2\nmodel=" MODEL "\nserial=" SERIAL_NUMBER "\nfirmware=" VERSION;
static const char CAN[] FLASH =
    "OK\noutput_low_v=" TEXT(OUTPUT_LOW_V) "\noutput_high_v=" TEXT(OUTPUT_HIGH_V)
    "\ninput_low_v=" TEXT(INPUT_LOW_V) "\ninput_high_v=" TEXT(INPUT_HIGH_V)
    "\noutput_bits=" TEXT(OUTPUT_BITS) "\ninput_bits=" TEXT(INPUT_BITS)
    "\nmin_rate_hz=" TEXT(MIN_RATE_HZ) "\nmax_rate_hz=" TEXT(MAX_RATE_HZ) "\nclock_hz=" TEXT(CLOCK_HZ)
    "\noutput_fifo=" TEXT(OUTPUT_FIFO) "\ninput_fifo=" TEXT(INPUT_FIFO) "\nhistory=0\nwatchdog_s=" TEXT(WATCHDOG_S)
    "\ninputs=" TEXT(INPUTS) "\nmax_total_rate_hz=" TEXT(MAX_RATE_HZ);
static const char DONE[] FLASH = "OK\n";
static const char UNKNOWN[] FLASH = "ERROR unknown command";
static const char LENGTHY[] FLASH = "ERROR the command is too long";
static const char BAD_ARM[] FLASH = "ERROR ARM samples divider level ramp_ms inputs; a number is missing or out of range";
static const char BAD_SAFE[] FLASH = "ERROR SAFE level ramp_ms; a number is missing or out of range";
static const char NOT_ARMED[] FLASH = "ERROR not armed";
static const char LEVEL[] FLASH = ""; /* stands for the text that only the moment of sending knows */

static const char ASK_WHO[] FLASH = "ID?", ASK_CAN[] FLASH = "CAP?", ASK_LEVEL[] FLASH = "LEVEL?";
static const char DO_ARM[] FLASH = "ARM", DO_GO[] FLASH = "GO", DO_HALT[] FLASH = "HALT", DO_SAFE[] FLASH = "SAFE";

struct range {
    uint32_t start, stop;
};

/* The frame being sent. Its payload comes from flash, from `small`, or is samples of the input. */
static struct {
    uint8_t head[HEAD_SIZE];
    const char *flash;
    uint8_t small[32];
    bool samples;
    uint32_t number;
    uint16_t length, at;
    uint32_t crc;
} out;
static bool sending;

static uint32_t last_number, sent, beat_ms;
static bool obeyed, reply_due, live, draining;
static const char *reply;
static struct range waiting[WAITING];
static uint8_t waiting_count;

static bool read_ramp(char **text, struct ramp *ramp)
{
    int64_t level, ms;
    if (!text_number(text, -OUTPUT_TOP, OUTPUT_TOP, &level) || !text_number(text, 0, LONGEST_RAMP_MS, &ms))
        return false;
    ramp->level = (int16_t)level;
    ramp->ms = (uint16_t)ms;
    return true;
}

static const char *arm(char *text)
{
    int64_t total, divider, inputs;
    struct ramp safe;
    if (!text_number(&text, 1, UINT32_MAX, &total) || !text_number(&text, LEAST_DIVIDER, MOST_DIVIDER, &divider)
        || !read_ramp(&text, &safe) || !text_number(&text, 1, INPUTS, &inputs) || *text)
        return BAD_ARM;
    run_arm((uint32_t)total, (uint32_t)divider, safe);
    sent = 0;
    waiting_count = 0;
    beat_ms = board_ms() - BEAT_MS;
    live = true;
    draining = false;
    return DONE;
}

static const char *make_safe(char *text)
{
    struct ramp safe;
    if (!read_ramp(&text, &safe) || *text)
        return BAD_SAFE;
    live = draining = false;
    run_safe(safe);
    return DONE;
}

static const char *halt(void)
{
    live = draining = false;
    run_halt();
    return DONE;
}

/* Return whether `text` is the command `word` and nothing else. */
static bool alone(char *text, const char *word)
{
    return text_word(&text, word) && !*text;
}

static const char *obey(char *text)
{
    if (alone(text, ASK_WHO))
        return WHO;
    if (alone(text, ASK_CAN))
        return CAN;
    if (alone(text, ASK_LEVEL))
        return LEVEL;
    if (alone(text, DO_GO))
        return run_go() ? DONE : NOT_ARMED;
    if (alone(text, DO_HALT))
        return halt();
    if (text_word(&text, DO_ARM))
        return arm(text);
    return text_word(&text, DO_SAFE) ? make_safe(text) : UNKNOWN;
}

void talk_obey(uint32_t number, char *command, bool whole)
{
    run_watch();
    if (!obeyed || number != last_number)
        reply = whole ? obey(command) : LENGTHY;
    obeyed = reply_due = true;
    last_number = number;
}

void talk_again(uint32_t start, uint32_t stop)
{
    if (stop > sent)
        stop = sent;
    if (start < stop && waiting_count < WAITING) /* else the host asks once more */
        waiting[waiting_count++] = (struct range){start, stop};
}

static void frame(enum kind kind, uint32_t number, uint16_t length)
{
    struct head head = {kind, number, length};
    head_write(&head, out.head);
    out.crc = CRC32_START;
    out.number = number;
    out.length = length;
    out.at = 0;
    out.samples = kind == INPUT || kind == RESENT;
    sending = true;
}

static void flash_frame(enum kind kind, uint32_t number, const char *text)
{
    frame(kind, number, text_length(text));
    out.flash = text;
}

static void small_frame(enum kind kind, uint32_t number, uint8_t length)
{
    frame(kind, number, length);
    out.flash = 0;
}

static void send_level(void)
{
    static const char STATES[][8] FLASH = {"idle", "armed", "running", "ramping"};
    static const char LEVEL_IS[] FLASH = "OK\nlevel=", NONE[] FLASH = "none", STATE_IS[] FLASH = "\nstate=";
    int16_t level;
    bool known = run_level(&level);
    char *text = text_append((char *)out.small, LEVEL_IS);
    text = known ? text_write(text, level) : text_append(text, NONE);
    text = text_append(text_append(text, STATE_IS), STATES[run_state()]);
    small_frame(REPLY, last_number, (uint8_t)(text - (char *)out.small));
}

static void send_reply(void)
{
    reply_due = false;
    if (reply == LEVEL)
        send_level();
    else
        flash_frame(REPLY, last_number, reply);
}

/* Report where the run is; a run nobody listens to is not reported for ever. */
static void send_status(void)
{
    uint32_t played = run_played();
    uint8_t conditions = run_take_conditions();
    out.small[0] = run_state() == RUNNING;
    out.small[1] = conditions;
    put_u32(out.small + 2, run_accepted());
    put_u32(out.small + 6, played);
    put_u32(out.small + 10, sent);
    small_frame(STATUS, 0, 14);
    beat_ms = board_ms();
    live = !(run_silent_ms() > WATCHDOG_MS && sent == played);
    draining = true;
}

/* Return the first sample that is kept, and stays so while a frame is sent. */
static uint32_t oldest(void)
{
    uint32_t played = run_played();
    return played > INPUT_FIFO - MARGIN ? played - (INPUT_FIFO - MARGIN) : 0;
}

static uint32_t send_samples(enum kind kind, uint32_t start, uint32_t stop)
{
    uint8_t count = stop - start > SAMPLES ? SAMPLES : (uint8_t)(stop - start);
    frame(kind, start, 2 * count);
    return start + count;
}

static void send_again(void)
{
    struct range *range = &waiting[waiting_count - 1];
    uint32_t first = oldest();
    if (range->start < first) {
        uint32_t stop = first < range->stop ? first : range->stop;
        put_u32(out.small, range->start);
        put_u32(out.small + 4, stop);
        small_frame(LOST, range->start, 8);
        range->start = stop;
    } else {
        range->start = send_samples(RESENT, range->start, range->stop);
    }
    if (range->start == range->stop)
        waiting_count--;
}

/* Send the next samples read. Which were lost before them is told when the host asks for them, but first that some were:
 * from the status it knows the cause. */
static void send_input(void)
{
    uint32_t first = oldest(), played = run_played();
    if (sent < first) {
        run_mark(OVERRUN);
        sent = first;
        send_status();
        return;
    }
    if (sent < played)
        sent = send_samples(INPUT, sent, played);
    draining = sent < played;
}

/* Begin the next frame: answers first, then the beat, then what is asked for again while the input can wait. */
static void next_frame(void)
{
    uint32_t unsent = run_played() - sent;
    if (reply_due)
        send_reply();
    else if (live && board_ms() - beat_ms >= BEAT_MS)
        send_status();
    else if (waiting_count && unsent < INPUT_FIFO / 2)
        send_again();
    else if (draining || (live && unsent >= SAMPLES))
        send_input();
}

static uint8_t payload_byte(uint16_t at)
{
    if (out.samples) {
        uint16_t code = (uint16_t)run_input(out.number + at / 2);
        return (uint8_t)(at & 1 ? code >> 8 : code);
    }
    return out.flash ? flash_byte(out.flash + at) : out.small[at];
}

/* Spoil the check of samples that were overwritten while they were sent: no sample is better than a wrong one. */
static void close_frame(void)
{
    bool stale = out.samples && run_played() - out.number > INPUT_FIFO;
    put_u32(out.head, stale ? out.crc : ~out.crc);
}

static uint8_t next_byte(void)
{
    uint8_t byte;
    if (out.at >= HEAD_SIZE + out.length)
        return out.head[out.at - HEAD_SIZE - out.length];
    byte = out.at < HEAD_SIZE ? out.head[out.at] : payload_byte(out.at - HEAD_SIZE);
    out.crc = crc32(out.crc, byte);
    return byte;
}

bool talk(void)
{
    for (uint8_t count = 0; count < TURN; count++) {
        if (!sending)
            next_frame();
        if (!sending || !board_room())
            return false;
        board_send(next_byte());
        if (++out.at == HEAD_SIZE + out.length)
            close_frame();
        sending = out.at < HEAD_SIZE + out.length + CHECK_SIZE;
    }
    return true;
}
