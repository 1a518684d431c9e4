/* What the board tells of itself, put where the host reads it. [main] */
#ifndef PUBLICATION_H
#define PUBLICATION_H

/* Identity and limits, once at power-up. */
void publish_constants(void);

/* All that changes; with the lock, so that it is of one moment. */
void publish_status(void);

#endif
