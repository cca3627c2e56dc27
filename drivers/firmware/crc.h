/* Which check belongs to a run of bytes? CRC-16/CCITT from 0, and the CRC-32 of zlib from ~0, inverted at the end. */
#ifndef CRC_H
#define CRC_H

#include <stdint.h>

#define CRC32_START 0xFFFFFFFFUL

uint16_t crc16(uint16_t crc, uint8_t byte);
uint32_t crc32(uint32_t crc, uint8_t byte);

#endif
