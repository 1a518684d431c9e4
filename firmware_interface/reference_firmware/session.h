/* Which host commands the board, and when it was heard last. Held by a key that the host draws;
 * everybody else may read, and may stop the machine, which ends the hold. The stopped host may know
 * nothing of it yet, so its key holds the board no more; under another one it comes as a new host.
 * Looked at by the sample interrupt; in the main loop, hold the lock. */
#ifndef SESSION_H
#define SESSION_H

#include <stdbool.h>
#include <stdint.h>

/* Before the first sample. */
void session_init(void);

/* [sample] Let go of a host that has fallen silent; never while something guards what it began and
 * will end it, so that a second host cannot take over a motion. */
void session_sample(bool guarded);

/* Whether a write of this key would be accepted: the board is free or this host holds it, and
 * nobody has stopped it. A heartbeat of the host that let go last comes late. */
bool session_open_to(uint32_t key, bool heartbeat);

/* The host with this key holds the board from now on, and feeds the watchdog. */
void session_claim(uint32_t key);

/* Let go, if this host holds the board. */
void session_release(uint32_t key);

/* A host of this key stops the machine: the hold of another one ends, even one run out. */
void session_stop(uint32_t key);

/* Whether this key is the holder's. */
bool session_held_by(uint32_t key);

/* The holder's key; 0 when there is none. */
uint32_t session_key(void);

/* For so long the holder is safe from others; 0 when there is none. */
uint32_t session_remaining_us(void);

/* Since the holder fed the watchdog. */
uint32_t session_silence_us(void);

#endif
