// The FPGA of a two-axis feed drive: encoders, effort and the sample clock behind a few registers.
// A processor runs the reference firmware beside it; fpga.h names the registers for it.
module feed_drive #(
    parameter CYCLES_PER_US      = 50,    // of the clock
    parameter SAMPLE_US          = 2500,  // period of the sample tick
    parameter TAKE_OVER_US       = 300,   // from the tick until new effort is in force
    parameter WATCHDOG_US        = 10000, // without a fed sample: no effort
    parameter EFFORT_BITS        = 15     // effort counts of a pulse that is always on, as bits
) (
    input  wire        clock,
    input  wire        reset,             // for at least four cycles
    // Bus: a write takes one cycle; read_data follows address without a clock.
    input  wire        write,
    input  wire [3:0]  address,
    input  wire [31:0] write_data,
    output reg  [31:0] read_data,
    output reg         sampled,           // for one cycle, when the samples are latched
    // The drive; bit n belongs to axis n.
    input  wire [1:0]  track_a,
    input  wire [1:0]  track_b,
    input  wire        sto_n,             // low, or a broken wire: the emergency stop is pressed
    input  wire [3:0]  switches,          // bits 2n and 2n + 1: negative and positive end of axis n
    output wire [1:0]  pulse,
    output wire [1:0]  negative,
    output wire        brake_release
);
    localparam [3:0] ID = 0, STATUS = 1, CONTROL = 2, SAMPLE = 3, STAMP = 4, TIME = 5,
                     COUNT_X = 6, COUNT_Z = 7, EFFORT = 8, LIMIT = 9;
    localparam [31:0] ID_VALUE = 32'h46444831; // FDH1
    localparam integer SAMPLE_CYCLES = SAMPLE_US * CYCLES_PER_US,
                       TAKE_OVER_CYCLES = TAKE_OVER_US * CYCLES_PER_US,
                       WATCHDOG_CYCLES = WATCHDOG_US * CYCLES_PER_US;

    // ---- time: microseconds, and the tick of the samples
    reg [31:0] phase, fraction, time_us;
    wire tick = phase == SAMPLE_CYCLES - 1;
    wire microsecond = fraction == CYCLES_PER_US - 1;
    always @(posedge clock) begin
        phase <= reset || tick ? 0 : phase + 1;
        fraction <= reset || microsecond ? 0 : fraction + 1;
        time_us <= reset ? 0 : time_us + {31'd0, microsecond};
    end

    // ---- encoders, and the latch that freezes both counts and the time at one edge
    wire [31:0] count_x, count_z;
    wire [1:0] illegal;
    reg enable;
    wire setting = write && !enable; // what may change only while the effort is off
    quadrature_counter encoder_x (.clock(clock), .reset(reset), .a(track_a[0]), .b(track_b[0]),
        .preset(setting && address == COUNT_X), .preset_count(write_data),
        .count(count_x), .illegal(illegal[0]));
    quadrature_counter encoder_z (.clock(clock), .reset(reset), .a(track_a[1]), .b(track_b[1]),
        .preset(setting && address == COUNT_Z), .preset_count(write_data),
        .count(count_z), .illegal(illegal[1]));

    reg [31:0] sample, stamp_us, latched_x, latched_z;
    reg [4:0] inputs, inputs_fresh;
    reg [3:0] pressed; // as often as samples: contacts have stopped bouncing
    always @(posedge clock) begin
        sampled <= tick && !reset;
        inputs_fresh <= {sto_n, switches};
        inputs <= inputs_fresh;
        if (reset)
            sample <= 0;
        else if (tick) begin
            sample <= sample + 1;
            stamp_us <= time_us;
            latched_x <= count_x;
            latched_z <= count_z;
            pressed <= inputs[3:0];
        end
    end

    // ---- what stops the effort, and holds it stopped until the processor re-arms
    wire rearm = write && address == STATUS;
    reg [31:0] unfed;
    wire starved = unfed == WATCHDOG_CYCLES;
    reg stopped_by_sto, stopped_by_watchdog;
    reg [1:0] lost_count;
    // verilator lint_off SYNCASYNCNET
    always @(posedge clock or negedge sto_n) // without the clock: no pulse is too short
        if (!sto_n)
            stopped_by_sto <= 1;
        else if (reset || rearm)
            stopped_by_sto <= 0;
    // verilator lint_on SYNCASYNCNET
    always @(posedge clock) begin
        // feeding takes the number of the latched sample: a program that runs in a circle has none
        if (reset || (write && address == SAMPLE && write_data == sample) || !enable)
            unfed <= 0;
        else if (!starved)
            unfed <= unfed + 1;
        stopped_by_watchdog <= !reset && (starved || (stopped_by_watchdog && !rearm));
        lost_count <= reset ? 0 : illegal | (rearm ? 2'd0 : lost_count);
    end
    wire stopped = stopped_by_sto || stopped_by_watchdog || lost_count != 0;

    // ---- effort: written for both axes at once, in force a fixed time after the latch
    reg signed [15:0] effort_x, effort_z;
    reg [14:0] limit_x, limit_z;
    wire gate = enable && !stopped;
    assign brake_release = gate;
    always @(posedge clock) begin
        if (reset || stopped)
            enable <= 0;
        else if (write && address == CONTROL)
            enable <= write_data[0];
        if (reset || !gate)
            {effort_z, effort_x} <= 0;
        else if (write && address == EFFORT)
            {effort_z, effort_x} <= write_data;
        if (reset)
            {limit_z, limit_x} <= 0;
        else if (setting && address == LIMIT)
            {limit_z, limit_x} <= {write_data[30:16], write_data[14:0]};
    end
    wire take_over = phase == TAKE_OVER_CYCLES;
    effort_output #(.FULL_SCALE_BITS(EFFORT_BITS)) output_x (.clock(clock), .gate(gate),
        .take_over(take_over), .effort(effort_x), .limit(limit_x),
        .pulse(pulse[0]), .negative(negative[0]));
    effort_output #(.FULL_SCALE_BITS(EFFORT_BITS)) output_z (.clock(clock), .gate(gate),
        .take_over(take_over), .effort(effort_z), .limit(limit_z),
        .pulse(pulse[1]), .negative(negative[1]));

    // ---- what the processor reads
    always @(*)
        case (address)
            ID:      read_data = ID_VALUE;
            STATUS:  read_data = {20'd0, pressed, 2'd0, gate, lost_count, stopped_by_watchdog,
                                  stopped_by_sto, !inputs[4]};
            CONTROL: read_data = {31'd0, enable};
            SAMPLE:  read_data = sample;
            STAMP:   read_data = stamp_us;
            TIME:    read_data = time_us;
            COUNT_X: read_data = latched_x;
            COUNT_Z: read_data = latched_z;
            EFFORT:  read_data = {effort_z, effort_x};
            LIMIT:   read_data = {1'b0, limit_z, 1'b0, limit_x};
            default: read_data = 0;
        endcase
endmodule
