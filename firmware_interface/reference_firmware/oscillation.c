#include "oscillation.h"

#include <math.h>
#include <string.h>

#include "numbers.h"
#include "port.h"

/* Of the effort limit: what the effort sweeps in a swing that counts, and its rms value where it
 * alternates. */
#define LARGE_SHARE 0.3f
#define LONGEST_SWING_S 0.7f
#define SHORTEST_TIME_S 0.25f /* an impact rings for less */
#define FED_CYCLES 2u /* that overlap: three swings */
#define DECAY 0.5f /* a swing of less than this share of the largest is one that dies away */
#define LATEST 3u /* samples of control delay; a longer one counts as this */
#define EFFORTS 8u /* remembered */
/* Means over so many samples, of deviation and effort alike: encoder rounding, which the feedback
 * turns into effort one sample later, would look like work. */
#define SMOOTHED 4u

/* Sums over the samples of a swing, in counts. */
struct swing {
    uint32_t samples;
    float way, square, work; /* of the deviation's steps, of their squares, times the effort */
    float effort, lowest_effort, highest_effort;
    float reference_way, reference_square;
};

static struct watch {
    float effort[EFFORTS]; /* of the feedback, asked for in the samples before */
    int32_t deviation[SMOOTHED], position[SMOOTHED]; /* of the samples before */
    struct swing last; /* whole */
    struct swing now; /* from the last turning point to the farthest point since */
    struct swing back; /* from there on */
    int direction; /* of `now`; 0 before the first */
    unsigned fed_cycles;
    uint32_t fed_samples;
    float largest_way;
    float alternating; /* mean square of what smoothing takes from the effort */
} watches[FD_AXES];
static uint32_t samples; /* since the reset */

void oscillation_reset(void)
{
    memset(watches, 0, sizeof watches);
    samples = 0;
}

static void add(struct swing *sum, const struct swing *part)
{
    sum->lowest_effort = sum->samples == 0 ? part->lowest_effort
                                           : fminf(sum->lowest_effort, part->lowest_effort);
    sum->highest_effort = sum->samples == 0 ? part->highest_effort
                                            : fmaxf(sum->highest_effort, part->highest_effort);
    sum->samples += part->samples;
    sum->way += part->way;
    sum->square += part->square;
    sum->work += part->work;
    sum->effort += part->effort;
    sum->reference_way += part->reference_way;
    sum->reference_square += part->reference_square;
}

/* The feedback's effort in a period: what was asked for at its beginning comes into force a control
 * delay later. `back` periods before the one that ends now. */
static float effort_in_force(const struct watch *watch, uint32_t back)
{
    const uint32_t delay_ns = port_settings()->control_delay_ns;
    const uint32_t whole = delay_ns / SAMPLE_PERIOD_NS;
    const uint32_t late = back + (whole < LATEST ? whole : LATEST);
    const float share = (float)(delay_ns % SAMPLE_PERIOD_NS) / (float)SAMPLE_PERIOD_NS;
    const float before = watch->effort[(samples - late - 2u) % EFFORTS];
    const float after = watch->effort[(samples - late - 1u) % EFFORTS];
    return after + share * (before - after);
}

static float mean_effort(const struct watch *watch)
{
    float total = 0.0f;
    for (uint32_t back = 0; back < SMOOTHED; back++) {
        total += effort_in_force(watch, back);
    }
    return total / (float)SMOOTHED;
}

/* What a step of so many counts over all smoothed samples adds to their mean. */
static float share_of(int32_t step)
{
    return (float)step / (float)SMOOTHED;
}

static bool counts(const struct swing *swing, float limit_counts)
{
    return swing->highest_effort - swing->lowest_effort >= LARGE_SHARE * limit_counts
        && (float)swing->samples * SAMPLE_PERIOD_S <= LONGEST_SWING_S;
}

/* Whether the feedback fed the cycle that ends here. */
static bool fed(const struct watch *watch, float limit_counts)
{
    struct swing cycle = watch->last;
    add(&cycle, &watch->now);
    const float drift = cycle.way / (float)cycle.samples;
    /* a constant effort, against a load, does no work on a swing to and fro */
    const float work = cycle.work - cycle.effort * drift;
    const float speed_power = cycle.square - cycle.way * drift;
    const float asked_power = cycle.reference_square
        - cycle.reference_way * cycle.reference_way / (float)cycle.samples;
    return counts(&watch->last, limit_counts) && counts(&watch->now, limit_counts)
        && work > 0.0f && speed_power > asked_power
        && fabsf(watch->now.way) >= DECAY * fmaxf(watch->largest_way, fabsf(watch->last.way));
}

/* At a turning point, where a swing has ended; whether it is one too many. */
static bool swung(struct watch *watch, float limit_counts)
{
    if (fed(watch, limit_counts)) {
        watch->fed_samples += watch->now.samples + (watch->fed_cycles ? 0u : watch->last.samples);
        watch->fed_cycles++;
        watch->largest_way = fmaxf(watch->largest_way, fabsf(watch->now.way));
    } else {
        watch->fed_cycles = 0;
        watch->fed_samples = 0;
        watch->largest_way = 0.0f;
    }
    watch->last = watch->now;
    watch->now = watch->back;
    memset(&watch->back, 0, sizeof watch->back);
    watch->direction = -watch->direction;
    return watch->fed_cycles >= FED_CYCLES
        && (float)watch->fed_samples * SAMPLE_PERIOD_S >= SHORTEST_TIME_S;
}

static bool alternates(const struct watch *watch, float limit_counts)
{
    const float large = LARGE_SHARE * limit_counts;
    return watch->alternating > large * large;
}

/* A sample more; true at a turning point too many. */
static bool seen(struct watch *watch, int32_t position, int32_t following_error,
                 float limit_counts)
{
    const unsigned oldest = samples % SMOOTHED;
    const float step = share_of(counts_between(-following_error, watch->deviation[oldest]));
    const float reference_step = share_of(counts_between(position, watch->position[oldest])) - step;
    const float effort = mean_effort(watch), taken = effort_in_force(watch, 0) - effort;
    watch->alternating += SAMPLE_PERIOD_S / SHORTEST_TIME_S * (taken * taken - watch->alternating);
    const struct swing part = {1u, step, step * step, effort * step, effort, effort, effort,
                               reference_step, reference_step * reference_step};
    watch->deviation[oldest] = -following_error;
    watch->position[oldest] = position;
    if (samples < SMOOTHED) {
        return false; /* there is no step before it */
    }
    add(&watch->back, &part);
    const bool moved = fabsf(watch->back.way) > (float)REST_COUNTS;
    if (watch->direction == 0 && moved) {
        watch->direction = watch->back.way > 0.0f ? 1 : -1;
    }
    if ((float)watch->direction * watch->back.way > 0.0f) {
        add(&watch->now, &watch->back);
        memset(&watch->back, 0, sizeof watch->back);
    } else if (moved && watch->direction != 0) {
        return swung(watch, limit_counts);
    }
    return false;
}

bool oscillation_seen(const struct drive_sample *sample)
{
    bool swinging = false;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const float limit_nm = port_settings()->axis[axis].effort_nm;
        const float limit_counts = limit_nm / port_settings()->effort_per_count_nm;
        swinging = seen(&watches[axis], sample->position[axis], sample->following_error[axis],
                        limit_counts)
            || alternates(&watches[axis], limit_counts) || swinging;
        watches[axis].effort[samples % EFFORTS] = sample->feedback[axis];
    }
    samples++;
    return swinging;
}
