/* What is a frame on the wire? The same as in drivers/framing.py and drivers/serial_messages.py:
 *
 *   A5 5A | kind u8 | number u32 | length u16 | CRC-16 of these 9 bytes | payload | CRC-32 of all before it
 */
#ifndef FRAMES_H
#define FRAMES_H

#include <stdbool.h>
#include <stdint.h>

#define MARKER_0 0xA5
#define MARKER_1 0x5A
#define HEAD_SIZE 11
#define CHECK_SIZE 4
#define MOST_PAYLOAD 2048

enum kind { COMMAND = 1, REPLY, OUTPUT, INPUT, RESENT, STATUS, LOST, AGAIN, ALIVE };

struct head {
    uint8_t kind;
    uint32_t number;
    uint16_t length;
};

/* Write a header with its check to `bytes`. */
void head_write(const struct head *head, uint8_t bytes[HEAD_SIZE]);

/* Read a header; false when its marker, its check or its length is wrong. */
bool head_read(struct head *head, const uint8_t bytes[HEAD_SIZE]);

/* Little endian, as all numbers on the wire. */
void put_u32(uint8_t *bytes, uint32_t value);
uint32_t get_u32(const uint8_t *bytes);

#endif
