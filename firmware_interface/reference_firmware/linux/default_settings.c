#include "default_settings.h"

#define FIVES 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f, 5.0f

const struct axis_settings default_axis = {
    .travel_rad = 10.0f,
    .speed_rad_s = 4.0f,
    .acceleration_rad_s2 = 60.0f,
    .effort_nm = 12.0f,
    .following_error_rad = 0.6f,
    .gain_step = 0.6f,
    .effort_jump_nm = 2.4f, /* hosts keep a motion's own effort within eight tenths of the limit */
    .gain_maximum = {
        .proportional = 600.0f, .derivative = 60.0f, .integral = 2000.0f, .velocity_filter = 0.1f,
        .inertia_feedforward = 2.0f, .viscous_feedforward = 5.0f, .coulomb_feedforward = 5.0f,
        .coulomb_smoothing = 5.0f, .offset_feedforward = 5.0f, .stribeck_feedforward = 5.0f,
        .stribeck_speed = 5.0f, .viscous_difference_feedforward = 5.0f,
        .ripple_cosine = {5.0f, 5.0f, 5.0f, 5.0f}, .ripple_sine = {5.0f, 5.0f, 5.0f, 5.0f},
        .ripple_period = {20.0f, 20.0f, 20.0f, 20.0f},
        .friction_top_speed = 20.0f, .friction_forward = {FIVES}, .friction_backward = {FIVES},
        .table_start = 20.0f, .table_step = 5.0f, .load_table = {FIVES, FIVES},
        .local_friction_table = {FIVES, FIVES}, .table_fade_speed = 20.0f,
        .ripple_fade_speed = {20.0f, 20.0f, 20.0f, 20.0f}, .presliding_feedforward = 5.0f,
        .presliding_distance = 5.0f, .backlash_offset = 0.2f, .backlash_distance = 5.0f,
        .deadband_inverse = 5.0f, .deadband_smoothing = 5.0f, .cross_inertia_feedforward = 2.0f,
        .cross_viscous_feedforward = 5.0f, .cross_coulomb_feedforward = 5.0f,
        .transmission_loss = 0.9f, .transmitted_inertia = 2.0f, .transmitted_friction = 2.0f,
    },
    .first_gains = { /* soft feedback without feed-forward */
        .proportional = 30.0f, .derivative = 4.0f, .velocity_filter = 0.01f,
        .coulomb_smoothing = 0.1f, .stribeck_speed = 1.0f,
        .ripple_period = {1.0f, 1.0f, 1.0f, 1.0f}, .friction_top_speed = 1.0f, .table_step = 1.0f,
        .presliding_distance = 1.0f, .backlash_distance = 1.0f, .deadband_smoothing = 1.0f,
    },
};

/* rigid-body sums of the virtual board's drive: docs/virtual_board.md */
const struct plant default_plants[FD_AXES] = {
    {0.42957, 0.90029, 1.40046, 0.03000, 0.0, 0.0},
    {0.37860, 0.74970, 1.10046, 0.09992, 0.0, 0.0},
};
