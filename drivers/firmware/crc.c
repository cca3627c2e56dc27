#include "crc.h"

#include "settings.h"

/* CRC-32 of the sixteen half bytes, polynomial EDB88320h (reversed). */
static const uint32_t HALF_BYTES[16] FLASH = {
    0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
    0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
};

/* Shift one byte in, polynomial 1021h: the eight steps of the long division in four exclusive ors. */
uint16_t crc16(uint16_t crc, uint8_t byte)
{
    crc = (uint16_t)(crc << 8 | crc >> 8) ^ byte;
    crc ^= (crc & 0xFF) >> 4;
    crc ^= (uint16_t)(crc << 12);
    crc ^= (crc & 0xFF) << 5;
    return crc;
}

/* Shift one byte in, half a byte at a time: the table of whole bytes would be half the memory of a small controller. */
uint32_t crc32(uint32_t crc, uint8_t byte)
{
    crc = flash_word(&HALF_BYTES[(crc ^ byte) & 15]) ^ crc >> 4;
    return flash_word(&HALF_BYTES[(crc ^ (uint8_t)(byte >> 4)) & 15]) ^ crc >> 4;
}
