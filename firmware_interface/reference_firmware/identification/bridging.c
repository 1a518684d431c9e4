#include "bridging.h"

#include <string.h>

#include "pause.h"

#define BLOCKS PERIOD_BLOCKS

static bool stands(const float *position, const struct standstills *rule, uint32_t first)
{
    double lowest = 0.0, highest = 0.0;
    for (uint32_t n = 0; n < rule->width; n++) {
        const double at =
            (double)position[(first + n + BLOCKS - rule->turn) % BLOCKS] / rule->samples;
        lowest = n == 0 || at < lowest ? at : lowest;
        highest = n == 0 || at > highest ? at : highest;
    }
    return highest - lowest <= rule->largest_range;
}

void mark_standstills(const float position[PERIOD_BLOCKS], const struct standstills *rule,
                      bool still[PERIOD_BLOCKS])
{
    /* after so long, 3 % of the filter's response to a standstill are left */
    const uint32_t margin = (3u * rule->width + 1u) / 2u;
    memset(still, 0, BLOCKS * sizeof *still);
    for (uint32_t first = 0; first + rule->width <= BLOCKS && rule->width < BLOCKS; first++) {
        if (first % 16u == 0u) {
            identification_pause();
        }
        if (!stands(position, rule, first)) {
            continue;
        }
        const uint32_t begin = first > margin ? first - margin : 0u;
        for (uint32_t n = begin; n < first + rule->width + margin && n < BLOCKS; n++) {
            still[n] = true;
        }
    }
}

double moving_share(const bool still[PERIOD_BLOCKS])
{
    uint32_t moving = 0;
    for (uint32_t n = 0; n < BLOCKS; n++) {
        moving += !still[n];
    }
    return (double)moving / BLOCKS;
}

static struct complex between(struct complex low, struct complex high, double part)
{
    return complex_of(low.re + part * (high.re - low.re), low.im + part * (high.im - low.im));
}

void bridge(struct complex signals[PERIOD_BLOCKS], const bool still[PERIOD_BLOCKS])
{
    if (moving_share(still) <= 0.0) {
        return;
    }
    for (uint32_t begin = 0, end; begin < BLOCKS; begin = end) {
        for (end = begin + 1u; end < BLOCKS && still[end] == still[begin]; end++) {
        }
        if (!still[begin]) {
            continue;
        }
        /* a standstill at an end of the period keeps the value at its other end */
        const struct complex after = signals[end < BLOCKS ? end : begin - 1u];
        const struct complex before = begin > 0 ? signals[begin - 1u] : after;
        for (uint32_t n = begin; n < end; n++) {
            signals[n] = between(before, after, (double)(n - begin + 1u) / (end - begin + 1u));
        }
    }
}
