// Counts every edge of an incremental encoder's tracks A and B. Forwards, A leads B.
module quadrature_counter (
    input  wire        clock,
    input  wire        reset,
    input  wire        a,
    input  wire        b,
    input  wire        preset,       // take over preset_count
    input  wire [31:0] preset_count,
    output reg  [31:0] count,        // two's complement; wraps around
    output wire        illegal       // both tracks changed at once: the count is lost
);
    // The tracks know nothing of our clock: two flip-flops make them safe to use, the third
    // remembers what they were.
    reg [1:0] fresh, tracks, previous;
    wire [1:0] changed = tracks ^ previous;
    wire forwards = tracks[0] != previous[1]; // 00 10 11 01: A differs from what B was

    assign illegal = !reset && changed == 2'b11;

    always @(posedge clock) begin
        fresh <= {b, a};
        tracks <= fresh;
        previous <= tracks;
        if (reset)
            count <= 0;
        else if (preset)
            count <= preset_count;
        else if (^changed)
            count <= forwards ? count + 1 : count - 1;
    end
endmodule
