#include "crc.h"

#include "settings.h"

/* CRC-32 of a byte, polynomial EDB88320h (reversed): that of a sum is the sum of those of its bits. */
#define OF_BIT(byte, bit, crc) ((byte) >> (bit) & 1 ? (crc) : 0)
#define OF(byte) \
    (OF_BIT(byte, 0, 0x77073096) ^ OF_BIT(byte, 1, 0xEE0E612C) ^ OF_BIT(byte, 2, 0x076DC419) \
     ^ OF_BIT(byte, 3, 0x0EDB8832) ^ OF_BIT(byte, 4, 0x1DB71064) ^ OF_BIT(byte, 5, 0x3B6E20C8) \
     ^ OF_BIT(byte, 6, 0x76DC4190) ^ OF_BIT(byte, 7, 0xEDB88320))
#define FOUR(byte) OF(byte), OF((byte) + 1), OF((byte) + 2), OF((byte) + 3)
#define SIXTEEN(byte) FOUR(byte), FOUR((byte) + 4), FOUR((byte) + 8), FOUR((byte) + 12)
#define SIXTY_FOUR(byte) SIXTEEN(byte), SIXTEEN((byte) + 16), SIXTEEN((byte) + 32), SIXTEEN((byte) + 48)

static const uint32_t OF_BYTE[256] FLASH = {SIXTY_FOUR(0), SIXTY_FOUR(64), SIXTY_FOUR(128), SIXTY_FOUR(192)};

/* Shift one byte in, polynomial 1021h: the eight steps of the long division in four exclusive ors. */
uint16_t crc16(uint16_t crc, uint8_t byte)
{
    crc = (uint16_t)(crc << 8 | crc >> 8) ^ byte;
    crc ^= (crc & 0xFF) >> 4;
    crc ^= (uint16_t)(crc << 12);
    crc ^= (crc & 0xFF) << 5;
    return crc;
}

/* Shift one byte in: this is most of the work of a sample, so a kilobyte of flash for it is well spent. */
uint32_t crc32(uint32_t crc, uint8_t byte)
{
    return flash_word(&OF_BYTE[(uint8_t)crc ^ byte]) ^ crc >> 8;
}
