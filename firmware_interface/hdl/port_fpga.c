#include "port_fpga.h"

#include "../reference_firmware/port.h"
#include "fpga.h"

static uint32_t sample_read; /* number of the sample whose counts were read last */
static uint16_t homed;

static uint32_t both(uint16_t x, uint16_t z)
{
    return (uint32_t)z << 16u | x;
}

static uint16_t limit_of(unsigned axis)
{
    const struct board_settings *settings = port_settings();
    return (uint16_t)(settings->axis[axis].effort_nm / settings->effort_per_count_nm + 0.5f);
}

bool port_fpga_open(uint16_t homed_axes)
{
    homed = homed_axes;
    fpga_write(FPGA_CONTROL, 0);
    fpga_write(FPGA_LIMIT, both(limit_of(0), limit_of(1)));
    return fpga_read(FPGA_ID) == FPGA_ID_VALUE;
}

/* The latch is taken again at every tick: where one came in between, read again. */
void port_read_encoders(int32_t counts[FD_AXES])
{
    do {
        sample_read = fpga_read(FPGA_SAMPLE);
        counts[0] = (int32_t)fpga_read(FPGA_COUNT_X);
        counts[1] = (int32_t)fpga_read(FPGA_COUNT_Z);
    } while (fpga_read(FPGA_SAMPLE) != sample_read);
}

/* Feeds the watchdog too: as long as somebody reads every sample and answers it with an effort. */
void port_write_effort(const int16_t counts[FD_AXES])
{
    fpga_write(FPGA_EFFORT, both((uint16_t)counts[0], (uint16_t)counts[1]));
    fpga_write(FPGA_SAMPLE, sample_read);
}

/* One bit for brake and effort: neither is on without the other. */
void port_release_brake(bool released)
{
    fpga_write(FPGA_CONTROL, released ? FPGA_ENABLE : 0);
}

bool port_sto_active(void)
{
    return (fpga_read(FPGA_STATUS) & FPGA_STOP_PRESSED) != 0;
}

/* Whatever made the FPGA drop the effort by itself counts as the wired stop. */
bool port_sto_latched(void)
{
    return (fpga_read(FPGA_STATUS) & (FPGA_STOP_LATCHED | FPGA_WATCHDOG | FPGA_LOST_COUNT)) != 0;
}

/* An axis that lost a count does not know its reference mark any more. */
void port_sto_rearm(void)
{
    const uint32_t lost = fpga_read(FPGA_STATUS) & FPGA_LOST_COUNT;
    homed = (uint16_t)(homed & ~(lost >> FPGA_LOST_COUNT_SHIFT));
    fpga_write(FPGA_STATUS, 0);
}

uint16_t port_homed(void)
{
    return homed;
}

uint16_t port_limit_switches(void)
{
    return (uint16_t)(fpga_read(FPGA_STATUS) >> FPGA_SWITCHES_SHIFT & 0xFu);
}
