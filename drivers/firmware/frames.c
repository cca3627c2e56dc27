#include "frames.h"

#include "crc.h"

#define CHECKED 9

void put_u32(uint8_t *bytes, uint32_t value)
{
    for (uint8_t i = 0; i < 4; i++, value >>= 8)
        bytes[i] = (uint8_t)value;
}

uint32_t get_u32(const uint8_t *bytes)
{
    uint32_t value = 0;
    for (uint8_t i = 4; i--;)
        value = value << 8 | bytes[i];
    return value;
}

static uint16_t head_check(const uint8_t *bytes)
{
    uint16_t crc = 0;
    for (uint8_t i = 0; i < CHECKED; i++)
        crc = crc16(crc, bytes[i]);
    return crc;
}

void head_write(const struct head *head, uint8_t bytes[HEAD_SIZE])
{
    bytes[0] = MARKER_0;
    bytes[1] = MARKER_1;
    bytes[2] = head->kind;
    put_u32(bytes + 3, head->number);
    bytes[7] = (uint8_t)head->length;
    bytes[8] = (uint8_t)(head->length >> 8);
    uint16_t crc = head_check(bytes);
    bytes[9] = (uint8_t)crc;
    bytes[10] = (uint8_t)(crc >> 8);
}

bool head_read(struct head *head, const uint8_t bytes[HEAD_SIZE])
{
    head->kind = bytes[2];
    head->number = get_u32(bytes + 3);
    head->length = (uint16_t)(bytes[7] | bytes[8] << 8);
    return bytes[0] == MARKER_0 && bytes[1] == MARKER_1 && head->length <= MOST_PAYLOAD
        && head_check(bytes) == (uint16_t)(bytes[9] | bytes[10] << 8);
}
