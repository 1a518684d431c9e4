/* Tries every sequence of operations up to a length, on a reduced state: from a board just powered
 * up, what hosts, machine and time do to it, one after the other. Two sequences that lead to the same
 * situation are one (`struct situation`: the board's state with times and speeds in a few steps), so
 * that the number of sequences stays within bounds; the first that leads there, a shortest one, goes
 * on. fuzz_invariants.c says what must hold at every sample and request, and `leave_alone` what must
 * come of every situation by itself. Usage: explore DEPTH */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../capture_ring.h"
#include "../drive.h"
#include "../gain_banks.h"
#include "../handover.h"
#include "../machine.h"
#include "../register_file.h"
#include "../session.h"
#include "../setpoints.h"
#include "client.h"
#include "fuzz_invariants.h"
#include "simulation.h"
#include "snapshot.h"

#define LONGEST 12u /* operations */
#define MOST_SITUATIONS (1u << 21)
#define SHAKE_SAMPLES 8u
#define SHAKE_RAD_S 0.4
#define QUIET_SAMPLES 3200u /* longer than lease, watchdog, confirm window and every stop */

static uint32_t table_crc, bank_crc;
static struct fd_gain_bank first[FD_AXES], other[FD_AXES]; /* in force at first; staged */
static struct fd_gain_bank settled[FD_AXES]; /* in force last while nothing waited for CONFIRM */
static bool shaking;
static bool unconfirmed, stopped; /* a commit waits; QUICK_STOP came after it */

/* ---- what must hold */

static void require(bool holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "broken: %s (state %d, fault %d)\n", what, (int)machine.state,
                (int)machine.fault);
        abort();
    }
}

static bool in_force(const struct fd_gain_bank gains[FD_AXES])
{
    return memcmp(gain_banks_active(), gains, FD_AXES * sizeof *gains) == 0
        && register_u32(FD_REG_ACTIVE_CRC) == register_gains_crc(GAINS_ACTIVE);
}

/* ---- operations */

/* Gains of another commit are not those that a stop takes back. */
static void note_commit(void)
{
    stopped = stopped && (unconfirmed || !gain_banks_unconfirmed());
    unconfirmed = gain_banks_unconfirmed();
}

static void samples(unsigned count)
{
    for (; count > 0; count--) {
        if (shaking) {
            const bool up = (machine.samples / SHAKE_SAMPLES) % 2u != 0;
            simulation.plants[0].velocity_rad_s = up ? SHAKE_RAD_S : -SHAKE_RAD_S;
        }
        simulation_pass(SAMPLE_US);
        note_commit();
    }
}

static void write_key(uint32_t key)
{
    uint16_t words[4];
    client_put_u32(words, key);
    client_put_u32(&words[2], capture_ring_counters().pages_written);
    client_write(FD_REG_SESSION_KEY, words, 4u);
}

static void stop_by_another(void)
{
    uint16_t words[COMMAND_WORDS];
    client_command_words(words, FD_OPCODE_QUICK_STOP, 0, CLIENT_KEY + 1u);
    client_write(FD_REG_COMMAND_OPCODE, words, COMMAND_WORDS);
    stopped = true;
}

static void quick_stop(void)
{
    client_command(FD_OPCODE_QUICK_STOP, 0);
    stopped = true;
}


static void enable(void) { client_command(FD_OPCODE_ENABLE, 0); }
static void disable(void) { client_command(FD_OPCODE_DISABLE, 0); }
static void arm(void) { client_command(FD_OPCODE_ARM, table_crc); }
static void start(void) { client_command(FD_OPCODE_START, FD_MAP_CRC); }
static void commit(void) { client_command(FD_OPCODE_COMMIT, bank_crc); }
static void commit_running(void) { client_command(FD_OPCODE_COMMIT_RUNNING, bank_crc); }
static void finish(void) { client_command(FD_OPCODE_FINISH, 0); }
static void confirm(void) { client_command(FD_OPCODE_CONFIRM, 0); }
static void roll_back(void) { client_command(FD_OPCODE_ROLL_BACK, 0); }
static void store(void) { client_command(FD_OPCODE_STORE, FD_STORE_SIGNATURE); }
static void clear_fault(void) { client_command(FD_OPCODE_CLEAR_FAULT, 0); }
static void heartbeat(void) { write_key(CLIENT_KEY); }
static void press(void) { simulation_press_stop(true); }
static void release(void) { simulation_press_stop(false); }
static void few_samples(void) { samples(10u); }
static void silence(void) { samples(500u); }
static void push(void) { simulation.plants[0].velocity_rad_s = 1.5; }
static void shake(void) { shaking = !shaking; }
static void break_coupling(void)
{
    static const struct plant rest = {0.016, 0.032, 0.048, 0.0, 0.0, 0.0};
    simulation.plants[0].inertia = rest.inertia;
    simulation.plants[0].viscous_friction = rest.viscous_friction;
    simulation.plants[0].coulomb_friction = rest.coulomb_friction;
}

static void cut_power(void) { simulation_power_cycle(); }

/* After a stop or a fault the old gains are back as soon as the axes stand. */
static void half_a_second(void)
{
    samples(200u);
    if (drive_at_rest() && (stopped || machine.fault != FD_FAULT_NONE)) {
        require(!gain_banks_unconfirmed(), "no roll-back after a stop or a fault");
    }
}

/* Left alone, every motion and every stop ends, and gains that nobody confirmed are gone. */
static void leave_alone(void)
{
    samples(QUIET_SAMPLES);
    require(machine.state == FD_STATE_IDLE || machine.state == FD_STATE_ARMED
                || machine.state == FD_STATE_DONE || machine.state == FD_STATE_FAULT,
            "a motion or a stop without an end");
    require(!gain_banks_unconfirmed() && in_force(settled), "no roll-back came");
    require(session_key() == 0, "a host that is gone holds the board");
    require(shaking || !drive_powered() || drive_at_rest(), "effort that keeps an axis moving");
}

/* Three at once, or most sequences would be too short to get into a motion. */
static void move(void)
{
    enable();
    arm();
    few_samples();
    start();
}

static const struct operation {
    const char *name;
    void (*run)(void);
} operations[] = {
    {"ENABLE", enable}, {"DISABLE", disable}, {"ARM", arm}, {"START", start},
    {"QUICK_STOP", quick_stop}, {"FINISH", finish}, {"COMMIT", commit},
    {"COMMIT_RUNNING", commit_running}, {"CONFIRM", confirm}, {"ROLL_BACK", roll_back},
    {"STORE", store}, {"CLEAR_FAULT", clear_fault}, {"heartbeat", heartbeat},
    {"QUICK_STOP by another host", stop_by_another}, {"stop pressed", press},
    {"stop released", release}, {"25 ms", few_samples}, {"0.5 s", half_a_second},
    {"silence of 1.25 s", silence}, {"silence of 8 s", leave_alone}, {"axis pushed", push},
    {"shaking begins or ends", shake}, {"power cut", cut_power},
    {"ENABLE, ARM, 25 ms, START", move}, {"coupling broken", break_coupling},
};
#define OPERATIONS (sizeof operations / sizeof operations[0])

/* ---- situations */

struct situation {
    enum fd_state state;
    enum fd_fault fault;
    bool roll_back_due;
    uint32_t until_capture; /* in steps of 20 samples */
    bool shaking, broken, stopped, powered, brake_released, sto_pressed, sto_latched;
    bool unconfirmed, staged, held, at_rest, setpoints_move, drained;
    uint32_t lease_s, silence, window; /* the last two in quarters of their length */
    uint32_t plant_moves, active_crc, stored_crc;
    enum fd_result handover;
};

static struct situation situation(void)
{
    struct situation now;
    memset(&now, 0, sizeof now);
    now.state = machine.state;
    now.fault = machine.fault;
    now.roll_back_due = machine.roll_back_due;
    now.until_capture = machine.until_capture / 20u;
    now.shaking = shaking;
    now.broken = simulation.plants[0].inertia < 0.1;
    now.stopped = stopped;
    now.powered = drive_powered();
    now.brake_released = simulation.brake_released;
    now.sto_pressed = simulation.stop_pressed;
    now.sto_latched = simulation.stop_latched;
    now.unconfirmed = gain_banks_unconfirmed();
    now.staged = gain_banks_staged_crc_ok();
    now.held = session_key() != 0;
    now.at_rest = drive_at_rest();
    now.setpoints_move = setpoints_moving();
    now.drained = capture_ring_drained();
    now.lease_s = session_remaining_us() / 1000000u;
    now.silence = session_silence_us() < 1000000u ? session_silence_us() / 250000u : 4u;
    now.window = gain_banks_remaining_us() / 500000u;
    now.plant_moves = (uint32_t)(fabs(simulation.plants[0].velocity_rad_s) * 4.0);
    now.active_crc = register_gains_crc(GAINS_ACTIVE);
    for (size_t n = 0; n < sizeof simulation.memory[0]; n++) {
        now.stored_crc = 31u * now.stored_crc + simulation.memory[0][n] + simulation.memory[1][n];
    }
    now.handover = handover_result() == FD_RESULT_PENDING ? FD_RESULT_PENDING : FD_RESULT_NONE;
    return now;
}

static uint64_t hash(const struct situation *of)
{
    const unsigned char *bytes = (const unsigned char *)of;
    uint64_t sum = 14695981039346656037u; /* FNV-1a */
    for (size_t n = 0; n < sizeof *of; n++) {
        sum = (sum ^ bytes[n]) * 1099511628211u;
    }
    return sum > 0 ? sum : 1u;
}

/* ---- the search; outside of the variables, which are put back again and again */

struct search {
    uint64_t known[2u * MOST_SITUATIONS]; /* hashes, open addressing */
    struct {
        uint32_t parent;
        uint8_t operation, depth;
    } nodes[MOST_SITUATIONS];
    uint32_t count;
    unsigned long sequences, states[16];
    uint32_t at; /* node and operation that are tried */
    unsigned trying;
};

static struct search *search; /* set once, before anything is put aside */

static void tell(uint32_t node)
{
    if (node != 0) {
        tell(search->nodes[node].parent);
        fprintf(stderr, "%s, ", operations[search->nodes[node].operation].name);
    }
}

static void on_abort(int number)
{
    fprintf(stderr, "after: ");
    tell(search->at);
    fprintf(stderr, "%s\n", operations[search->trying].name);
    signal(number, SIG_DFL);
    raise(number);
}

static bool learn(uint64_t sum)
{
    size_t at = sum % (2u * MOST_SITUATIONS);
    for (; search->known[at] != 0; at = (at + 1u) % (2u * MOST_SITUATIONS)) {
        if (search->known[at] == sum) {
            return false;
        }
    }
    search->known[at] = sum;
    return true;
}

/* What an operation did; a new situation is kept. */
static void look(unsigned depth)
{
    require(in_force(first) || in_force(other), "gains that nobody wrote");
    const struct situation now = situation();
    if (!learn(hash(&now)) || search->count == MOST_SITUATIONS) {
        return;
    }
    search->nodes[search->count].parent = search->at;
    search->nodes[search->count].operation = (uint8_t)search->trying;
    search->nodes[search->count++].depth = (uint8_t)depth;
    search->states[machine.state]++;
}

static void operate(unsigned operation)
{
    operations[operation].run();
    note_commit();
    require(machine.fault == FD_FAULT_NONE || machine.state == FD_STATE_FAULT
                || machine.state == FD_STATE_STOPPING, "a fault that the state does not tell");
    if (!gain_banks_unconfirmed()) {
        memcpy(settled, gain_banks_active(), sizeof settled);
    }
}

static void come_to(uint32_t node)
{
    if (node != 0) {
        come_to(search->nodes[node].parent);
        operate(search->nodes[node].operation);
    }
}

static void begin(void)
{
    uint16_t table[TABLE_WORDS];
    simulation_reset();
    invariants_watch();
    simulation_power_cycle();
    samples(30u);
    write_key(CLIENT_KEY);
    client_begin_table(table, FD_TRAJECTORYKIND_MULTISINE, 40u, 60u);
    memcpy(first, gain_banks_active(), sizeof first);
    memcpy(other, first, sizeof other);
    memcpy(settled, first, sizeof settled);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        client_set_u16(table, axis, FD_REG_TRAJECTORY_X_COMPONENTS, 1u);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_AMPLITUDE, 0, 0.3f);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY, 0, 4.0f);
        other[axis].proportional = 60.0f;
        other[axis].derivative = 6.0f;
    }
    table_crc = client_table_crc(table);
    bank_crc = client_stage(other);
    require(client_write_table(table) && bank_crc != 0, "nothing to begin with");
}

int main(int count, char **words)
{
    const unsigned depth = count == 2 ? (unsigned)strtoul(words[1], NULL, 10) : 0;
    if (depth == 0 || depth > LONGEST) {
        fprintf(stderr, "usage: %s DEPTH, from 1 to %u\n", words[0], LONGEST);
        return 2;
    }
    search = calloc(1, sizeof *search);
    void *root = malloc(snapshot_size()), *parent = malloc(snapshot_size());
    require(search != NULL && root != NULL && parent != NULL, "no memory");
    signal(SIGABRT, on_abort);
    begin();
    search->count = 1u;
    snapshot_take(root);
    for (uint32_t node = 0; node < search->count && search->nodes[node].depth < depth; node++) {
        snapshot_restore(root);
        search->at = node;
        come_to(node);
        snapshot_take(parent);
        for (unsigned n = 0; n < OPERATIONS; n++) {
            snapshot_restore(parent);
            search->trying = n;
            search->sequences++;
            operate(n);
            look(search->nodes[node].depth + 1u);
        }
    }
    printf("%u operations, all sequences of up to %u: %lu tried, %u situations;", (unsigned)OPERATIONS,
           depth, search->sequences, search->count);
    for (unsigned state = 0; state <= FD_STATE_CHECKING; state++) {
        printf(" %lu", search->states[state]);
    }
    printf(" by state; nothing found\n");
    return search->count == MOST_SITUATIONS ? EXIT_FAILURE : EXIT_SUCCESS;
}
