/* The port layer: everything that the firmware asks of the hardware, and all that has to be
 * written for another board. docs/porting.md explains it for encoder counters in an FPGA.
 *
 * Two things run: the sample interrupt, every SAMPLE_PERIOD_NS, and the main loop, whenever the
 * interrupt leaves it time. [sample], [main] and [both] say who calls a function.
 */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "settings.h"

/* [both] What differs from board to board; must not change after power-up. */
const struct board_settings *port_settings(void);

/* [both] Free-running microseconds; may wrap around. */
uint32_t port_time_us(void);

/* [main] A number that differs from one power-up to the next, by chance. */
uint32_t port_random(void);

/* [main] Keep the sample interrupt out, and let it in again; never nested. */
void port_lock(void);
void port_unlock(void);

/* [sample] Encoder counts of all axes, latched by hardware at the instant of the sample clock. They
 * are zero where the axis stood at power-up, or at the reference mark where it is homed. */
void port_read_encoders(int32_t counts[FD_AXES]);

/* [both] PWM counts of all axes, in force control_delay_ns after the latch; zero is no effort. Of
 * two in one sample the later counts: where a fault is found it takes the effort back. */
void port_write_effort(const int16_t counts[FD_AXES]);

/* [both] Release the holding brake or apply it, every sample. */
void port_release_brake(bool released);

/* [both] Whether the wired emergency stop cuts the effort; an input, and only to be told of. */
bool port_sto_active(void);

/* [both] Whether it has done so since port_sto_rearm, for however short a time: latched by the
 * hardware, for a pulse between two samples must not be missed. */
bool port_sto_latched(void);

/* [main] Begin to watch for a pulse anew; changes nothing while the stop is active. */
void port_sto_rearm(void);

/* [main] Bit n: axis n counts from the machine's reference mark. May change only while the brake
 * is applied; so may the zero of the encoders. */
uint16_t port_homed(void);

/* [both] Bits 2n and 2n + 1: the limit switch of axis n at its negative and its positive end is
 * pressed; 0 where there are none. */
uint16_t port_limit_switches(void);

/* [main] Take bytes that the serial line received, at most so many; gives their number. */
size_t port_uart_receive(uint8_t *bytes, size_t capacity);

/* [main] Send a frame; may return before it is out. */
void port_uart_send(const uint8_t *bytes, size_t length);

#define STORE_SLOTS 2u

/* [main] Permanent memory of STORE_SLOTS slots that can be erased each without the other, such as
 * two flash sectors. A write may be cut by a power failure at any byte; false tells of a failure.
 * The sample interrupt must be served meanwhile. */
bool port_store_read(unsigned slot, void *data, size_t size);
bool port_store_write(unsigned slot, const void *data, size_t size);

#endif
