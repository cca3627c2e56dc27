/* Which frames arrive whole? */
#ifndef RECEIVE_H
#define RECEIVE_H

/* Take the bytes that arrived and hand every whole frame to talk.h. */
void receive(void);

#endif
