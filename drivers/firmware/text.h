/* How are numbers read from text and written to it? */
#ifndef TEXT_H
#define TEXT_H

#include <stdbool.h>
#include <stdint.h>

/* Read a decimal number within [low, high], and move `text` behind it and the spaces after it; false when it is none. */
bool text_number(char **text, int64_t low, int64_t high, int64_t *value);

/* Take the word `word`, a constant in flash, and the spaces after it from the front of `text`; false when it is not there. */
bool text_word(char **text, const char *word);

/* Return the length of a constant in flash. */
uint16_t text_length(const char *constant);

/* Write a constant in flash to `text`; return where it ends. */
char *text_append(char *text, const char *constant);

/* Write a decimal number to `text`; return where it ends. */
char *text_write(char *text, int16_t value);

#endif
