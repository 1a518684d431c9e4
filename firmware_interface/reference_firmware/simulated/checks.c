/* Usage: checks NAME; without a name, prints those that there are. */
#include "checks.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../machine.h"
#include "client.h"
#include "simulation.h"

void check_holds(int holds, const char *condition, const char *file, int line)
{
    if (!holds) {
        fprintf(stderr, "%s:%d: not so: %s (state %d, fault %d, last result %d)\n", file, line,
                condition, (int)machine.state, (int)machine.fault,
                (int)client_u16(FD_REG_STATUS_LAST_RESULT));
        exit(EXIT_FAILURE);
    }
}

void check_set_up(void)
{
    simulation_power_cycle();
    simulation_samples(30);
    CHECK(client_write_u32(FD_REG_SESSION_KEY, CLIENT_KEY) == 0);
    CHECK(client_command(FD_OPCODE_ENABLE, 0) == FD_RESULT_DONE);
}

void check_finish_arming(void)
{
    while (machine.state == FD_STATE_CHECKING) {
        simulation_pass(100u);
    }
}

void check_arm_sine(float amplitude_rad, float rate_rad_s, uint32_t capture_samples)
{
    uint16_t table[TABLE_WORDS];
    client_begin_table(table, FD_TRAJECTORYKIND_MULTISINE, 400u, capture_samples);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        client_set_u16(table, axis, FD_REG_TRAJECTORY_X_COMPONENTS, 1u);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_AMPLITUDE, 0, amplitude_rad);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY, 0, rate_rad_s);
    }
    CHECK(client_write_table(table));
    client_command(FD_OPCODE_ARM, client_table_crc(table));
    check_finish_arming();
}

static int run_from(const struct check *checks, unsigned count, const char *name)
{
    for (unsigned n = 0; n < count; n++) {
        if (name == NULL) {
            puts(checks[n].name);
        } else if (strcmp(checks[n].name, name) == 0) {
            simulation_reset();
            checks[n].run();
            return 1;
        }
    }
    return 0;
}

int main(int count, char **words)
{
    const char *name = count > 1 ? words[1] : NULL;
    const int found = run_from(board_checks, board_check_count, name)
        || run_from(motion_checks, motion_check_count, name)
        || run_from(transfer_checks, transfer_check_count, name)
        || run_from(stop_checks, stop_check_count, name)
        || run_from(identification_checks, identification_check_count, name);
    return found || name == NULL ? EXIT_SUCCESS : 2;
}
