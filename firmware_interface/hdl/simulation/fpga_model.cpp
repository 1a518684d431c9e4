#include "fpga_model.h"

#include <verilated.h>

// Verilator would start a thread of its own, and two threads take a press of the stop and its release
// at once: the release could come first
static VerilatedContext *without_threads()
{
    static VerilatedContext context;
    context.threads(1);
    return &context;
}

Vfeed_drive fpga_model(without_threads());
std::mutex fpga_bus;
void (*fpga_before_cycle)();
std::atomic<bool> fpga_interrupt, fpga_stop, fpga_stop_pulse;

double sc_time_stamp()
{
    return 0.0;
}

void fpga_cycle()
{
    if (fpga_before_cycle != nullptr) {
        fpga_before_cycle();
    }
    if (fpga_stop_pulse && fpga_stop_pulse.exchange(false)) { // to look is quicker than to exchange
        fpga_model.sto_n = 0;
        fpga_model.eval();
    }
    fpga_model.sto_n = !fpga_stop;
    fpga_model.clock = 0;
    fpga_model.eval();
    fpga_model.clock = 1;
    fpga_model.eval();
    if (fpga_model.sampled) {
        fpga_interrupt = true;
    }
}

void fpga_power_up()
{
    fpga_model.sto_n = 1;
    fpga_model.reset = 1;
    for (int cycle = 0; cycle < 8; cycle++) {
        fpga_cycle();
    }
    fpga_model.reset = 0;
    fpga_interrupt = false;
}

uint32_t fpga_read(enum fpga_register address)
{
    const std::lock_guard<std::mutex> held(fpga_bus);
    fpga_model.address = address;
    fpga_cycle();
    return fpga_model.read_data;
}

void fpga_write(enum fpga_register address, uint32_t word)
{
    const std::lock_guard<std::mutex> held(fpga_bus);
    fpga_model.address = address;
    fpga_model.write_data = word;
    fpga_model.write = 1;
    fpga_cycle();
    fpga_model.write = 0;
}
