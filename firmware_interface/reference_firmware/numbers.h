/* Conversions that are defined for every number, what is none included. */
#ifndef NUMBERS_H
#define NUMBERS_H

#include <stdbool.h>
#include <stdint.h>

/* Within +-limit. What is not finite becomes 0 and clears *finite, which is never set: a NaN
 * passes fminf and fmaxf as one of the limits, and would command full torque. */
float clamped(float value, float limit, bool *finite);

/* Rounded and saturating; 0 where the value is not finite. */
int16_t to_int16(float value);
int32_t to_int32(float value);

/* later - earlier of a counter that may have wrapped around in between. */
int32_t counts_between(int32_t later, int32_t earlier);

#endif
