/* What does the device answer, and when does it speak? The protocol is in drivers/serial_messages.py. */
#ifndef TALK_H
#define TALK_H

#include <stdbool.h>
#include <stdint.h>

/* Bytes of a command. */
#define MOST_COMMAND 47

/* Do the command `number` once, however often it arrives, and reply each time. */
void talk_obey(uint32_t number, char *command, bool whole);

/* Send the input samples [start, stop) again as far as they are kept, and say which are not. */
void talk_again(uint32_t start, uint32_t stop);

/* Send the next few bytes; false when there is nothing to send, or the queue is full. */
bool talk(void);

#endif
