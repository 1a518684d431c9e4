#include "fuzz_accidents.h"

#include <string.h>

#include "fuzz_values.h"
#include "simulation.h"

void fuzz_inputs(void)
{
    const unsigned axis = fuzz_below(FD_AXES);
    switch (fuzz_below(6)) {
    case 0:
        simulation_press_stop(true);
        simulation_press_stop(fuzz_rarely(3));
        break;
    case 1:
        simulation.limit_switches = (uint16_t)(fuzz_rarely(2) ? fuzz_below(16) : 0);
        break;
    case 2: /* the encoder loses its place, or is far from home */
        simulation.encoder_offset[axis] = fuzz_rarely(4) ? INT32_MAX - 100
            : fuzz_rarely(3) ? (int32_t)fuzz_below(1000) - 500 : 0;
        break;
    case 3: /* pushed by hand */
        simulation.plants[axis].velocity_rad_s = (double)fuzz_between(-2.0f, 2.0f);
        break;
    default:
        simulation_press_stop(false);
        simulation.limit_switches = 0;
        simulation.encoder_offset[axis] = 0;
        break;
    }
}

void fuzz_power(void)
{
    simulation.settings.turnaround_us = fuzz_rarely(2) ? 0 : LINE_GAP_US;
    simulation.memory_fails = fuzz_rarely(5);
    if (fuzz_rarely(10)) { /* cut in the middle of a write */
        simulation.memory[fuzz_below(STORE_SLOTS)][fuzz_below(208)] ^= 1u;
    }
    if (fuzz_rarely(2)) { /* brought back to where it started */
        memset(simulation.encoder_offset, 0, sizeof simulation.encoder_offset);
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            simulation.plants[axis].position_rad = simulation.plants[axis].velocity_rad_s = 0.0;
        }
    }
    simulation_power_cycle();
}

void fuzz_wait(void)
{
    simulation_samples(fuzz_rarely(50) ? 2500u : fuzz_below(60));
}
