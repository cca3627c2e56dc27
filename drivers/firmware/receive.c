#include "receive.h"

#include <string.h>

#include "board.h"
#include "crc.h"
#include "frames.h"
#include "run.h"
#include "talk.h"

#define PATIENCE_MS 50

static uint8_t head_bytes[HEAD_SIZE], body[MOST_COMMAND + 1];
static uint8_t head_count, check_count;
static uint16_t body_count;
static struct head head;
static uint32_t crc, byte_ms;
static bool fits;

static void begin(void)
{
    head_count = 0;
}

/* Look for the next marker inside a header that was none. */
static void search(void)
{
    uint8_t from = 1;
    while (from < head_count
           && !(head_bytes[from] == MARKER_0 && (from + 1 == head_count || head_bytes[from + 1] == MARKER_1)))
        from++;
    head_count -= from;
    memmove(head_bytes, head_bytes + from, head_count);
}

/* Samples go straight to their place in the FIFO, since there is no memory for them elsewhere. */
static void open_body(void)
{
    crc = CRC32_START;
    for (uint8_t i = 0; i < HEAD_SIZE; i++)
        crc = crc32(crc, head_bytes[i]);
    body_count = check_count = 0;
    fits = head.kind != OUTPUT || (head.length % 2 == 0 && run_open(head.number, head.length / 2));
}

static void take_head(uint8_t byte)
{
    head_bytes[head_count++] = byte;
    if (head_bytes[0] != MARKER_0 || (head_count > 1 && head_bytes[1] != MARKER_1))
        search();
    while (head_count == HEAD_SIZE && !head_read(&head, head_bytes))
        search();
    if (head_count == HEAD_SIZE)
        open_body();
}

static void take_body(uint8_t byte)
{
    static uint8_t low;
    crc = crc32(crc, byte);
    if (head.kind != OUTPUT) {
        if (body_count < MOST_COMMAND)
            body[body_count] = byte;
    } else if (!(body_count & 1)) {
        low = byte;
    } else if (fits) {
        fits = run_put((int16_t)(byte << 8 | low));
    }
    body_count++;
}

static void whole_frame(void)
{
    run_heard();
    if (head.kind == OUTPUT && fits) {
        run_accept();
    } else if (head.kind == OUTPUT) {
        run_mark(GAP);
    } else if (head.kind == COMMAND) {
        body[head.length < MOST_COMMAND ? head.length : MOST_COMMAND] = 0;
        talk_obey(head.number, (char *)body, head.length <= MOST_COMMAND);
    } else if (head.kind == AGAIN && head.length == 8) {
        talk_again(get_u32(body), get_u32(body + 4));
    }
}

static void take_check(uint8_t byte)
{
    if (byte != (uint8_t)(~crc >> 8 * check_count)) {
        begin();
    } else if (++check_count == CHECK_SIZE) {
        begin();
        whole_frame();
    }
}

void receive(void)
{
    uint8_t byte;
    while (board_receive(&byte)) {
        byte_ms = board_ms();
        if (head_count < HEAD_SIZE)
            take_head(byte);
        else if (body_count < head.length)
            take_body(byte);
        else
            take_check(byte);
    }
    if (head_count && board_ms() - byte_ms > PATIENCE_MS)
        begin(); /* the rest of this frame will not come */
}
