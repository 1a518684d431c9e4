// feed_drive.v, verilated: its pins, its clock, and the bus behind fpga_read and fpga_write.
#ifndef FPGA_MODEL_H
#define FPGA_MODEL_H

#include <atomic>
#include <mutex>

#include "Vfeed_drive.h"

extern "C" {
#include "../fpga.h"
}

inline constexpr unsigned CYCLES_PER_US = 1;
inline constexpr double FULL_SCALE_COUNTS = 4096; // effort of a pulse that is always on

extern Vfeed_drive fpga_model;
extern std::mutex fpga_bus; // held by whoever lets cycles pass
extern void (*fpga_before_cycle)(); // where not null: moves the pins
extern std::atomic<bool> fpga_interrupt; // set by the sample tick, cleared by whoever serves it
extern std::atomic<bool> fpga_stop; // the wire of the emergency stop is pressed
extern std::atomic<bool> fpga_stop_pulse; // it was, if only between two cycles

void fpga_power_up();
void fpga_cycle();

#endif
