/* The port for Linux: a pseudo-terminal for the serial line and a thread for the sample interrupt,
 * so that whatever forgets the lock is found out here. linux_drive.h is the drive behind it. */
#ifndef PORT_LINUX_H
#define PORT_LINUX_H

#include <stdbool.h>

struct linux_options {
    double speed; /* times real time */
    const char *store; /* file for permanent memory, or none */
    double confirm_window_s;
    double homed; /* bit n: axis n */
    const char *plant; /* socket of a plant in another process, or none */
    double switches_rad; /* limit switches this far from zero, both ways; 0: none */
};

/* Open the pseudo-terminal; gives the path for the host, or null. */
const char *port_linux_open(const struct linux_options *options);

/* Let the sample interrupt in, and keep it out for good. */
bool port_linux_start(void (*sample)(void));
void port_linux_end(void);

/* Wait for the line, at most a millisecond. */
void port_linux_wait(void);

/* The wired emergency stop; may be called by a signal handler, as a wire may. */
void port_linux_press_stop(bool pressed);

#endif
