// The drive of the firmware on Linux, with the simulated FPGA in between: pulses become a current,
// the current moves a rigid axis, and the axis turns an encoder.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "fpga_model.h"

extern "C" {
#include "../../reference_firmware/linux/default_settings.h"
#include "../../reference_firmware/linux/linux_drive.h"
#include "../../reference_firmware/port.h"
#include "../port_fpga.h"
}

static const double CURRENT_LAG_US = 200.0; // of the power stage
static const unsigned PLANT_US = 50; // the plant moves so often
static const unsigned EDGE_CYCLES = 4; // the encoder's edges are at least so far apart

const uint32_t linux_drive_serial_number = 3u;

static struct axis {
    struct plant plant;
    double effort_nm, sum_nm; // at the motor, and its sum since the plant moved last
    int32_t shown, target; // counts that the encoder's tracks stand for, and will
} axes[FD_AXES];
static double switches_rad;

static uint8_t bit(unsigned number, bool set)
{
    return static_cast<uint8_t>(set ? 1u << number : 0u);
}

static void move_plant(struct axis &axis)
{
    const double mean_nm = axis.sum_nm / (PLANT_US * CYCLES_PER_US);
    axis.sum_nm = 0.0;
    plant_advance(&axis.plant, mean_nm, PLANT_US * 1e-6);
    const double turns = axis.plant.position_rad / 6.283185307179586;
    axis.target = static_cast<int32_t>(std::lrint(turns * COUNTS_PER_TURN));
}

static void show_tracks()
{
    uint8_t a = 0, b = 0;
    for (unsigned n = 0; n < FD_AXES; n++) {
        axes[n].shown += (axes[n].target > axes[n].shown) - (axes[n].target < axes[n].shown);
        const unsigned phase = static_cast<unsigned>(axes[n].shown) % 4u; // 00 10 11 01
        a |= bit(n, phase == 1 || phase == 2);
        b |= bit(n, phase >= 2);
    }
    fpga_model.track_a = a;
    fpga_model.track_b = b;
}

static void show_switches()
{
    uint8_t pressed = 0;
    for (unsigned n = 0; n < FD_AXES && switches_rad > 0.0; n++) {
        pressed |= bit(2 * n, axes[n].plant.position_rad <= -switches_rad);
        pressed |= bit(2 * n + 1, axes[n].plant.position_rad >= switches_rad);
    }
    fpga_model.switches = pressed;
}

static void before_cycle()
{
    static unsigned cycle;
    const double share = 1.0 / (CURRENT_LAG_US * CYCLES_PER_US);
    for (unsigned n = 0; n < FD_AXES; n++) {
        const bool on = fpga_model.pulse >> n & 1, negative = fpga_model.negative >> n & 1;
        const double full_nm = FULL_SCALE_COUNTS * EFFORT_PER_COUNT_NM;
        const double pulse_nm = on ? (negative ? -full_nm : full_nm) : 0.0;
        axes[n].effort_nm += share * (pulse_nm - axes[n].effort_nm);
        axes[n].sum_nm += axes[n].effort_nm;
    }
    if (++cycle % (PLANT_US * CYCLES_PER_US) == 0) {
        for (struct axis &axis : axes) {
            move_plant(axis);
        }
        show_switches();
    }
    if (cycle % EDGE_CYCLES == 0) {
        show_tracks();
    }
}

void linux_drive_open(const struct linux_options *options)
{
    if (options->plant != nullptr) {
        std::fputs("behind the FPGA is a plant of its own: no --plant\n", stderr);
        std::exit(EXIT_FAILURE);
    }
    for (unsigned n = 0; n < FD_AXES; n++) {
        axes[n].plant = default_plants[n];
    }
    switches_rad = options->switches_rad;
    fpga_before_cycle = before_cycle;
    fpga_power_up();
    if (!port_fpga_open(static_cast<uint16_t>(options->homed))) {
        std::fputs("the FPGA does not answer\n", stderr);
        std::exit(EXIT_FAILURE);
    }
}

void linux_drive_sample(void (*on_sample)(void))
{
    {
        const std::lock_guard<std::mutex> held(fpga_bus);
        while (!fpga_interrupt.exchange(false)) {
            fpga_cycle();
        }
    }
    port_lock();
    on_sample();
    port_unlock();
}

void port_linux_press_stop(bool pressed)
{
    if (pressed) {
        fpga_stop_pulse = true;
    }
    fpga_stop = pressed;
}
