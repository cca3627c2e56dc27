#include "text.h"

#include "settings.h"

static void skip_spaces(char **text)
{
    while (**text == ' ')
        ++*text;
}

bool text_number(char **text, int64_t low, int64_t high, int64_t *value)
{
    bool negative = **text == '-';
    uint8_t digits = 0;
    *value = 0;
    for (*text += negative; **text >= '0' && **text <= '9' && digits < 11; ++*text, digits++)
        *value = *value * 10 + (**text - '0');
    bool ended = **text == ' ' || !**text;
    skip_spaces(text);
    *value = negative ? -*value : *value;
    return digits && ended && *value >= low && *value <= high;
}

bool text_word(char **text, const char *word)
{
    char *at = *text;
    for (; flash_byte(word); word++, at++)
        if (*at != (char)flash_byte(word))
            return false;
    if (*at && *at != ' ')
        return false;
    skip_spaces(&at);
    *text = at;
    return true;
}

uint16_t text_length(const char *constant)
{
    uint16_t length = 0;
    while (flash_byte(constant + length))
        length++;
    return length;
}

char *text_append(char *text, const char *constant)
{
    while (flash_byte(constant))
        *text++ = (char)flash_byte(constant++);
    return text;
}

char *text_write(char *text, int16_t value)
{
    uint16_t size = value < 0 ? -(uint16_t)value : (uint16_t)value, unit = 10000;
    if (value < 0)
        *text++ = '-';
    while (unit > 1 && size < unit)
        unit /= 10;
    for (; unit; unit /= 10)
        *text++ = (char)('0' + size / unit % 10);
    return text;
}
