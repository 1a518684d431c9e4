/* What the firmware on Linux moves: the part of the port behind which there is a drive. It also has
 * port_linux_press_stop. plant_drive.c is one; ../../hdl/simulation/ has another. */
#ifndef LINUX_DRIVE_H
#define LINUX_DRIVE_H

#include <stdint.h>

#include "port_linux.h"

extern const uint32_t linux_drive_serial_number;

void linux_drive_open(const struct linux_options *options);

/* Let one sample period pass, and call the sample interrupt in it, under the lock. */
void linux_drive_sample(void (*on_sample)(void));

#endif
