#include "self_test.h"

#include "gain_banks.h"
#include "port.h"

#define LARGEST_PAUSE_US 1000000u
#define LARGEST_WINDOW_US 1800000000u /* less than half of the clock's round */
#define LARGEST_DELAY_NS 100000000u
#define LARGEST_EFFORT_COUNTS 32767.0f /* of an int16_t */
/* a quarter of the counter's round: leaving the travel shows long before the counter wraps */
#define LARGEST_TRAVEL_COUNTS 536870912.0f

#define LARGEST_LOSS 0.9f /* the law divides by what is left */

/* Written so that what is no number fails. */
static bool positive(float value, float largest)
{
    return value > 0.0f && value <= largest;
}

static bool line_and_clock(const struct board_settings *settings)
{
    return settings->frame_gap_us > 0 && settings->frame_gap_us <= LARGEST_PAUSE_US
        && settings->turnaround_us <= LARGEST_PAUSE_US && settings->confirm_window_us > 0
        && settings->confirm_window_us < LARGEST_WINDOW_US
        && settings->control_delay_ns <= LARGEST_DELAY_NS;
}

static bool units(const struct board_settings *settings)
{
    return settings->counts_per_turn >= 4u && settings->counts_per_turn <= 1000000000u
        && positive(settings->effort_per_count_nm, 1e3f)
        && settings->effort_per_count_nm >= 1e-9f;
}

/* The largest values are those that the map lets a host believe. */
static bool limits(const struct board_settings *settings, const struct axis_settings *axis)
{
    const float counts_per_rad = (float)settings->counts_per_turn / TWO_PI;
    return positive(axis->travel_rad, 1e6f)
        && axis->travel_rad * counts_per_rad <= LARGEST_TRAVEL_COUNTS
        && positive(axis->speed_rad_s, 1e4f)
        && positive(axis->acceleration_rad_s2, 1e6f)
        && positive(axis->effort_nm, LARGEST_EFFORT_COUNTS * settings->effort_per_count_nm)
        && positive(axis->following_error_rad, 1e6f)
        && positive(axis->gain_step, 1.0f)
        && axis->effort_jump_nm >= 0.0f && axis->effort_jump_nm <= 1e6f
        && axis->inertia >= 0.0f && axis->inertia <= 1e6f
        && axis->viscous_friction >= 0.0f && axis->viscous_friction <= 1e6f
        && axis->gain_maximum.transmission_loss <= LARGEST_LOSS;
}

bool self_test_settings(void)
{
    const struct board_settings *settings = port_settings();
    struct fd_gain_bank first_gains[FD_AXES], maxima[FD_AXES];
    bool passed = line_and_clock(settings) && units(settings);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        passed = passed && limits(settings, &settings->axis[axis]);
        first_gains[axis] = settings->axis[axis].first_gains;
        maxima[axis] = settings->axis[axis].gain_maximum; /* have to be finite and of their sign */
    }
    return passed && gain_banks_within_maxima(maxima) && gain_banks_within_maxima(first_gains);
}
