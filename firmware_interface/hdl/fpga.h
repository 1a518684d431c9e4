/* The registers of feed_drive.v, for the processor beside it. */
#ifndef FPGA_H
#define FPGA_H

#include <stdint.h>

enum fpga_register {
    FPGA_ID = 0, /* FPGA_ID_VALUE */
    FPGA_STATUS = 1, /* bits below; any write re-arms what is latched */
    FPGA_CONTROL = 2, /* FPGA_ENABLE */
    FPGA_SAMPLE = 3, /* number of the latched sample; written, it feeds the watchdog */
    FPGA_STAMP = 4, /* when it was latched, in microseconds */
    FPGA_TIME = 5, /* microseconds now */
    FPGA_COUNT_X = 6, /* latched; written while disabled, it sets the counter */
    FPGA_COUNT_Z = 7,
    FPGA_EFFORT = 8, /* z in the upper half, x in the lower; in force at the next take-over */
    FPGA_LIMIT = 9, /* of the efforts' magnitudes, likewise; only while disabled */
};

#define FPGA_ID_VALUE 0x46444831u
#define FPGA_ENABLE 1u

#define FPGA_STOP_PRESSED 0x01u
#define FPGA_STOP_LATCHED 0x02u
#define FPGA_WATCHDOG 0x04u
#define FPGA_LOST_COUNT 0x18u /* bit 3 + n: axis n */
#define FPGA_LOST_COUNT_SHIFT 3u
#define FPGA_EFFORT_ON 0x20u
#define FPGA_SWITCHES_SHIFT 8u

/* The bus: on a board, a read and a write of a volatile word. */
uint32_t fpga_read(enum fpga_register address);
void fpga_write(enum fpga_register address, uint32_t word);

#endif
