#include "host_requests.h"

#include <stdbool.h>

#include "capture_ring.h"
#include "commands.h"
#include "gain_banks.h"
#include "machine.h"
#include "port.h"
#include "publication.h"
#include "session.h"

#define COMMAND_WORDS 6u
#define PAGES_END (FD_PAGE_ADDRESS + FD_PAGE_SLOTS * FD_PAGE_SLOT_REGISTERS)

/* A write that the map allows: no value is cut in two. */
struct request {
    uint16_t address;
    uint16_t count;
    const uint16_t *words;
};

static bool contains(const struct request *request, uint16_t address)
{
    return request->address <= address && address - request->address < request->count;
}

static uint16_t u16_of(const struct request *request, uint16_t address)
{
    return request->words[address - request->address];
}

static uint32_t u32_of(const struct request *request, uint16_t address)
{
    return (uint32_t)u16_of(request, address) << 16 | u16_of(request, (uint16_t)(address + 1u));
}

/* ---- reading */

static void copy_pages(uint16_t address, uint16_t count, uint16_t *words)
{
    for (uint32_t n = 0; n < count; n++) {
        words[n] = capture_ring_word(address + n - FD_PAGE_ADDRESS);
    }
}

enum access host_read(uint16_t address, uint16_t count, uint16_t *words)
{
    enum access result = ACCESS_DONE;
    port_lock();
    if (address >= FD_PAGE_ADDRESS && (uint32_t)address + count <= PAGES_END) {
        copy_pages(address, count, words);
    } else {
        publish_status();
        result = register_file_read(address, count, words);
    }
    port_unlock();
    return result;
}

/* ---- whether a write is taken; with the lock */

/* A command comes whole and by itself, or not at all. */
static bool cuts_command(const struct request *request)
{
    const bool touches = request->address < FD_REG_COMMAND_OPCODE + COMMAND_WORDS
        && request->address + request->count > FD_REG_COMMAND_OPCODE;
    return touches
        && (request->address != FD_REG_COMMAND_OPCODE || request->count != COMMAND_WORDS);
}

static bool unknown_code(const struct request *request, uint16_t address, uint16_t last)
{
    return contains(request, address)
        && (u16_of(request, address) == 0 || u16_of(request, address) > last);
}

/* Values that the map's ranges do not tell. */
static bool bad_value(const struct request *request)
{
    if (unknown_code(request, FD_REG_TRAJECTORY_KIND, FD_TRAJECTORYKIND_STAIRCASE)
        || unknown_code(request, FD_REG_WATCHDOG_ACTION, FD_WATCHDOGACTION_COAST)) {
        return true;
    }
    if (contains(request, FD_REG_SESSION_KEY) && u32_of(request, FD_REG_SESSION_KEY) == 0) {
        return true;
    }
    return contains(request, FD_REG_CAPTURE_PAGES_ACKNOWLEDGED)
        && !capture_ring_can_acknowledge(u32_of(request, FD_REG_CAPTURE_PAGES_ACKNOWLEDGED));
}

/* What another host's session or a motion forbids. */
static bool forbidden(const struct request *request)
{
    const bool watchdog = contains(request, FD_REG_WATCHDOG_TIMEOUT)
        || contains(request, FD_REG_WATCHDOG_ACTION);
    /* from ARM on: the host reads what it must keep up with before START */
    const bool armed =
        machine.state == FD_STATE_CHECKING || machine.state == FD_STATE_ARMED;
    if (watchdog && (armed || machine_in_motion())) {
        return true;
    }
    if (contains(request, FD_REG_SESSION_KEY)
        && !session_open_to(u32_of(request, FD_REG_SESSION_KEY),
                            contains(request, FD_REG_CAPTURE_PAGES_ACKNOWLEDGED))) {
        return true;
    }
    return contains(request, FD_REG_SESSION_RELEASE) && machine_busy()
        && session_held_by(u32_of(request, FD_REG_SESSION_RELEASE));
}

static enum access check(const struct request *request)
{
    const enum access result =
        register_file_check(request->address, request->count, request->words);
    if (result != ACCESS_DONE) {
        return result;
    }
    if (cuts_command(request)) {
        return ACCESS_NO_REGISTER;
    }
    return bad_value(request) ? ACCESS_BAD_VALUE
        : forbidden(request) ? ACCESS_BUSY : ACCESS_DONE;
}

/* ---- and what it does */

/* With the lock. What is armed is its host's: whoever holds the board next arms anew. */
static void claim(uint32_t key)
{
    if (machine.state == FD_STATE_ARMED && !session_held_by(key)) {
        machine.state = FD_STATE_IDLE;
    }
    session_claim(key);
}

/* With the lock. */
static void apply(const struct request *request)
{
    register_file_write(request->address, request->count, request->words);
    if (contains(request, FD_REG_SESSION_RELEASE)) {
        session_release(u32_of(request, FD_REG_SESSION_RELEASE));
    }
    if (contains(request, FD_REG_SESSION_KEY)) {
        claim(u32_of(request, FD_REG_SESSION_KEY));
    }
    if (contains(request, FD_REG_CAPTURE_PAGES_ACKNOWLEDGED)) {
        capture_ring_acknowledge(u32_of(request, FD_REG_CAPTURE_PAGES_ACKNOWLEDGED));
    }
}

enum access host_write(uint16_t address, uint16_t count, const uint16_t *words)
{
    const struct request request = {address, count, words};
    port_lock();
    const enum access result = check(&request);
    if (result == ACCESS_DONE) {
        apply(&request);
    }
    port_unlock();
    if (result == ACCESS_DONE && contains(&request, FD_REG_COMMAND_OPCODE)) {
        const struct command command = {
            u16_of(&request, FD_REG_COMMAND_OPCODE),
            u16_of(&request, FD_REG_COMMAND_TOKEN),
            u32_of(&request, FD_REG_COMMAND_ARGUMENT),
            u32_of(&request, FD_REG_COMMAND_KEY),
        };
        commands_execute(&command);
    } else if (result == ACCESS_DONE) {
        gain_banks_check_staged();
    }
    return result;
}
