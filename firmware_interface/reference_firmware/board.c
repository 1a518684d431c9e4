#include "board.h"

#include "capture_ring.h"
#include "commands.h"
#include "gain_banks.h"
#include "gain_store.h"
#include "identification.h"
#include "machine.h"
#include "modbus_rtu.h"
#include "port.h"
#include "publication.h"
#include "register_file.h"
#include "self_test.h"
#include "session.h"

#define WATCHDOG_TIMEOUT_MS 1000u

/* The gains stored last, or those of the settings. */
static void load_gains(void)
{
    struct fd_gain_bank gains[FD_AXES];
    if (!gain_store_load(gains)) {
        for (unsigned axis = 0; axis < FD_AXES; axis++) {
            gains[axis] = port_settings()->axis[axis].first_gains;
        }
    }
    gain_banks_init(gains);
}

void board_power_up(void)
{
    register_file_init();
    publish_constants();
    register_put_u16(FD_REG_WATCHDOG_TIMEOUT, WATCHDOG_TIMEOUT_MS);
    register_put_u16(FD_REG_WATCHDOG_ACTION, FD_WATCHDOGACTION_QUICK_STOP);
    modbus_rtu_init();
    session_init();
    commands_init();
    capture_ring_clear();
    identification_init();
    load_gains();
    machine_init(self_test_settings());
}

void board_sample(void)
{
    machine_sample();
}

/* All that hosts ask for; true where more of it waits. */
static bool serve(void)
{
    const bool request_waits = modbus_rtu_poll();
    const bool command_waits = commands_go_on();
    return request_waits || command_waits;
}

static void serve_meanwhile(void)
{
    (void)serve();
}

bool board_poll(void)
{
    identification_go_on(serve_meanwhile);
    return serve();
}
