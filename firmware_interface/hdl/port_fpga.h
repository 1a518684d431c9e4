/* The part of the port that has an FPGA behind it. The serial line, permanent memory, clock and lock
 * are the processor's. */
#ifndef PORT_FPGA_H
#define PORT_FPGA_H

#include <stdbool.h>
#include <stdint.h>

/* Before board_power_up: false where no such FPGA answers. Homed: bit n for axis n. */
bool port_fpga_open(uint16_t homed);

#endif
