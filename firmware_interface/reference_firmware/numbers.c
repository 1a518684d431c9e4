#include "numbers.h"

#include <math.h>

/* the largest float that an int32_t holds */
#define LARGEST_INT32 2147483520.0f

float clamped(float value, float limit, bool *finite)
{
    if (!isfinite(value)) {
        *finite = false;
        return 0.0f;
    }
    return fminf(fmaxf(value, -limit), limit);
}

int16_t to_int16(float value)
{
    bool finite = true;
    return (int16_t)lrintf(clamped(value, (float)INT16_MAX, &finite));
}

int32_t to_int32(float value)
{
    bool finite = true;
    return (int32_t)lrintf(clamped(value, LARGEST_INT32, &finite));
}

int32_t counts_between(int32_t later, int32_t earlier)
{
    const uint32_t difference = (uint32_t)later - (uint32_t)earlier;
    /* written so that nothing out of range is converted */
    return difference <= (uint32_t)INT32_MAX ? (int32_t)difference
                                             : -(int32_t)(UINT32_MAX - difference) - 1;
}
