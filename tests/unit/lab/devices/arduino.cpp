// Runs the sketch of docs/arduino on this machine: its pins turn a motor that is none, and its
// serial port is the terminal of which the path is given. Prints the true position and speed in mm.
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

typedef uint8_t byte;
enum { LOW, HIGH, INPUT_PULLUP, OUTPUT, CHANGE, RISING };
static const long INDEX_AT = 500;  // counts to the index pulse, where the sketch has a pin for it
static int duty, backwards, phase, master;
static void (*handlers[20])();

static double now() {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + t.tv_nsec * 1e-9;
}
static const double born = now();
unsigned long micros() { return (unsigned long)((now() - born) * 1e6); }
unsigned long millis() { return micros() / 1000; }
void pinMode(int, int) {}
void noInterrupts() {}
void interrupts() {}
int digitalPinToInterrupt(int pin) { return pin; }
void attachInterrupt(int pin, void (*handler)(), int) { handlers[pin] = handler; }
int digitalRead(int pin);
void digitalWrite(int, int value) { backwards = value; }
void analogWrite(int, int value) { duty = value; }
char *dtostrf(double value, int width, int digits, char *to) {
  sprintf(to, "%*.*f", width, digits, value);
  return to;
}
struct Port {
  void begin(long) {}
  int available() { struct pollfd p = {master, POLLIN, 0}; return poll(&p, 1, 0) > 0 && (p.revents & POLLIN); }
  int read() { char c; return ::read(master, &c, 1) == 1 ? c : -1; }
  void print(const char *text) { if (write(master, text, strlen(text)) < 0) exit(1); }
  void print(char c) { char text[2] = {c, 0}; print(text); }
  void print(long n) { char text[24]; sprintf(text, "%ld", n); print(text); }
} Serial;

#include SKETCH

// Quadrature: A leads B as the drum turns forward.
int digitalRead(int pin) {
  static const int a[4] = {0, 1, 1, 0}, b[4] = {0, 0, 1, 1};
  return pin == ENCODER_A_PIN ? a[phase] : b[phase];
}

int main(int, char **arguments) {
  master = posix_openpt(O_RDWR | O_NOCTTY);
  grantpt(master);
  unlockpt(master);
  bool stalled = false;
  int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
  (void)slave; (void)arguments;
  printf("%s\n", ptsname(master));
  fflush(stdout);
  setup();
  double speed = 0, position = 0, last = now(), said = last;
  long encoded = 0;
  for (;;) {
    double t = now(), dt = t - last;
    last = t;
    // 15% faster than the sketch is told, and friction.
    double aim = (backwards ? -1 : 1) * (duty < 3 ? 0 : duty - 2) / 255.0 * FULL_MM_S * 1.15;
    struct pollfd in = {0, POLLIN, 0};
    if (poll(&in, 1, 0) > 0) {
      char c;
      if (read(0, &c, 1) != 1) return 0;
      stalled = c == 's';
    }
    speed = stalled ? 0 : speed + (aim - speed) * (1 - exp(-dt / 0.1));
    position += speed * dt;
    long count = lround(position / MM_PER_COUNT);
    while (encoded != count) {
      int step = count > encoded ? 1 : -1;
      encoded += step;
      int before = phase;
      phase = (phase + step + 4) % 4;
      int changed_a = (before == 0 && phase == 1) || (before == 1 && phase == 0) ||
                      (before == 2 && phase == 3) || (before == 3 && phase == 2);
      handlers[changed_a ? ENCODER_A_PIN : ENCODER_B_PIN]();
      if (INDEX_PIN >= 0 && encoded == INDEX_AT) handlers[INDEX_PIN]();
    }
    loop();
    if (t - said > 0.02) {
      said = t;
      printf("%f %f\n", position, speed);
      fflush(stdout);
    }
    usleep(200);
  }
}
