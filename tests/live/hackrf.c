/* A stand-in for libhackrf.so.0: what Debian's hackrf_transfer calls to transmit, without a device.
 *
 * As the library does, it keeps four buffers of 262 144 bytes in flight: all are filled at the start, and each is filled anew once it
 * has been played at the sample rate. Played bytes go to the file of HACKRF_BYTES. A buffer that comes after the one before it has
 * ended is a shortfall: the radio sends nothing meanwhile. HACKRF_REPORT gets the frequency, the rate, the bytes, the number of
 * shortfalls and the longest in milliseconds.
 */
#define _GNU_SOURCE
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define BUFFERS 4
#define BUFFER_BYTES 262144
#define TRUE_ 1
#define STREAMING_EXIT_CALLED (-1004)

typedef struct device device;
typedef struct {
    device *device;
    uint8_t *buffer;
    int buffer_length;
    int valid_length;
    void *rx_ctx;
    void *tx_ctx;
} transfer;
typedef int (*fill_fn)(transfer *);
typedef void (*complete_fn)(transfer *, int);
typedef void (*flush_fn)(void *, int);

struct device {
    double rate_hz;
    uint64_t frequency_hz;
    fill_fn fill;
    complete_fn complete;
    flush_fn flush;
    void *flush_ctx, *tx_ctx;
    pthread_t thread;
    int started;
    volatile int streaming, stopping;
    FILE *bytes;
    unsigned long long played;
    unsigned shortfalls;
    double longest_s;
};

static device the_device;

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

static void wait_until(double at_s) {
    struct timespec at = {(time_t)at_s, (long)((at_s - (time_t)at_s) * 1e9)};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL) != 0) {
    }
}

/* Plays buffer after buffer; `ends_s` is when the newest one that was filled has been sent. */
static void *play(void *argument) {
    device *d = argument;
    static uint8_t memory[BUFFERS][BUFFER_BYTES];
    transfer transfers[BUFFERS];
    double ends_s[BUFFERS], newest_s = 0;
    int filled = 0, more = 1;
    for (int k = 0; k < BUFFERS; k++) {
        transfers[k] = (transfer){d, memory[k], BUFFER_BYTES, BUFFER_BYTES, NULL, d->tx_ctx};
        if (more && d->fill(&transfers[k]) == 0) {
            filled++;
        } else {
            more = 0;
        }
    }
    newest_s = now_s();
    for (int k = 0; k < filled; k++) {
        newest_s += transfers[k].valid_length / 2 / d->rate_hz;
        ends_s[k] = newest_s;
    }
    for (int k = 0; filled > 0; k = (k + 1) % BUFFERS) {
        wait_until(ends_s[k]);
        fwrite(transfers[k].buffer, 1, transfers[k].valid_length, d->bytes);
        d->played += transfers[k].valid_length;
        filled--;
        if (d->complete) {
            d->complete(&transfers[k], 1);
        }
        if (d->stopping) {
            break;
        }
        transfers[k].valid_length = BUFFER_BYTES;
        if (more && d->fill(&transfers[k]) == 0) {
            double late_s = now_s() - newest_s;
            if (late_s > 0) {
                d->shortfalls++;
                d->longest_s = late_s > d->longest_s ? late_s : d->longest_s;
                newest_s += late_s;
            }
            newest_s += transfers[k].valid_length / 2 / d->rate_hz;
            ends_s[k] = newest_s;
            filled++;
        } else {
            more = 0;
        }
    }
    fflush(d->bytes);
    d->streaming = 0;
    if (d->flush) {
        d->flush(d->flush_ctx, 1);
    }
    return NULL;
}

static void report(device *d) {
    const char *name = getenv("HACKRF_REPORT");
    FILE *file = name ? fopen(name, "w") : NULL;
    if (file) {
        fprintf(file, "frequency_hz=%llu\nrate_hz=%.0f\nbytes=%llu\nshortfalls=%u\nlongest_ms=%.0f\n",
                (unsigned long long)d->frequency_hz, d->rate_hz, d->played, d->shortfalls, 1e3 * d->longest_s);
        fclose(file);
    }
}

static int end(device *d) {
    d->stopping = 1;
    if (d->started) {
        pthread_join(d->thread, NULL);
        d->started = 0;
        report(d);
    }
    return 0;
}

int hackrf_init(void) { return 0; }
int hackrf_exit(void) { return 0; }

int hackrf_open_by_serial(const char *serial, device **opened) {
    (void)serial;
    const char *name = getenv("HACKRF_BYTES");
    the_device.bytes = fopen(name ? name : "/dev/null", "wb");
    *opened = &the_device;
    return the_device.bytes ? 0 : -5;
}

int hackrf_close(device *d) {
    end(d);
    fclose(d->bytes);
    return 0;
}

int hackrf_set_freq(device *d, uint64_t hz) {
    d->frequency_hz = hz;
    return 0;
}

int hackrf_set_sample_rate(device *d, double hz) {
    d->rate_hz = hz;
    return 0;
}

int hackrf_start_tx(device *d, fill_fn fill, void *ctx) {
    d->fill = fill;
    d->tx_ctx = ctx;
    d->streaming = 1;
    d->started = pthread_create(&d->thread, NULL, play, d) == 0;
    return d->started ? 0 : -1;
}

int hackrf_stop_tx(device *d) { return end(d); }
int hackrf_is_streaming(device *d) { return d->streaming ? TRUE_ : STREAMING_EXIT_CALLED; }

int hackrf_enable_tx_flush(device *d, flush_fn flush, void *ctx) {
    d->flush = flush;
    d->flush_ctx = ctx;
    return 0;
}

int hackrf_set_tx_block_complete_callback(device *d, complete_fn complete) {
    d->complete = complete;
    return 0;
}

/* Ten words: modes, counts, shortfalls. */
int hackrf_get_m0_state(device *d, uint32_t *state) {
    memset(state, 0, 10 * sizeof *state);
    state[4] = d->shortfalls;
    return 0;
}

uint32_t hackrf_compute_baseband_filter_bw(uint32_t hz) { return hz; }
const char *hackrf_error_name(int error) { return error == STREAMING_EXIT_CALLED ? "streaming terminated" : "stand-in"; }
const char *hackrf_filter_path_name(int path) { (void)path; return "none"; }
int hackrf_set_amp_enable(device *d, uint8_t on) { (void)d, (void)on; return 0; }
int hackrf_set_antenna_enable(device *d, uint8_t on) { (void)d, (void)on; return 0; }
int hackrf_set_baseband_filter_bandwidth(device *d, uint32_t hz) { (void)d, (void)hz; return 0; }
int hackrf_set_freq_explicit(device *d, uint64_t i, uint64_t lo, int path) { (void)d, (void)i, (void)lo, (void)path; return -1; }
int hackrf_set_hw_sync_mode(device *d, uint8_t on) { (void)d, (void)on; return 0; }
int hackrf_set_lna_gain(device *d, uint32_t db) { (void)d, (void)db; return 0; }
int hackrf_set_txvga_gain(device *d, uint32_t db) { (void)d, (void)db; return 0; }
int hackrf_set_vga_gain(device *d, uint32_t db) { (void)d, (void)db; return 0; }
int hackrf_start_rx(device *d, fill_fn fill, void *ctx) { (void)d, (void)fill, (void)ctx; return -1; }
int hackrf_stop_rx(device *d) { (void)d; return 0; }
