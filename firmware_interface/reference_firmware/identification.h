/* The board's own identification: after a motion it reads the parameters of both axes from its own
 * capture with a network (docs/chip.md). A firmware built without NETWORK has none: nothing is done
 * then, and its registers stay zero. */
#ifndef IDENTIFICATION_H
#define IDENTIFICATION_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"

#ifdef FD_IDENTIFICATION

/* [main] Before the first sample. */
void identification_init(void);

/* With the lock: a motion of so many captured samples begins, by the START of this token. What was
 * found of another is gone, and computing it ends. */
void identification_begin(uint16_t token, uint32_t capture_samples);

/* [sample] A captured sample; the last one has been captured; no capture is going on. */
void identification_add(const struct drive_sample *sample);
void identification_captured(void);
void identification_idle(void);

/* With the lock: put what is known into the registers. */
void identification_publish(void);

/* [main] Compute, if there is something to compute. It takes seconds on a slow processor; again and
 * again, at most a few hundred microseconds apart, it calls serve. */
void identification_go_on(void (*serve)(void));

#else

static inline void identification_init(void)
{
}

static inline void identification_begin(uint16_t token, uint32_t capture_samples)
{
    (void)token;
    (void)capture_samples;
}

static inline void identification_add(const struct drive_sample *sample)
{
    (void)sample;
}

static inline void identification_captured(void)
{
}

static inline void identification_idle(void)
{
}

static inline void identification_publish(void)
{
}

static inline void identification_go_on(void (*serve)(void))
{
    (void)serve;
}

#endif

#endif
