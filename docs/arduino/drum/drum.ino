// A drum turned by a DC motor with a quadrature encoder, for `afferents record`.
//
// Speaks lines of text at 115200 baud. Each ends with '*', the CRC-16/XMODEM of the bytes before it
// as a decimal number, and a newline; a line whose number is wrong is ignored, and sent again.
//
//   hello            -> hello
//   clear            -> clear                forgets a fault
//   speed 50.0       -> speed 50.00000       mm/s of the drum's surface, held by the loop below
//   stop             -> stop
//   state            -> state POSITION SPEED FAULT     mm, mm/s, and ok, stalled or watchdog;
//                       with an index pulse, POSITION is 'unknown' until the first one
//
// The drum stops when nothing is heard for WATCHDOG_MS. Wire an emergency stop into the motor's
// power as well: no program is a substitute for one.

// ---- Your drum: change these ----------------------------------------------------------------
const int PWM_PIN = 9;           // speed input of the motor driver
const int DIRECTION_PIN = 8;     // direction input of the motor driver
const int ENCODER_A_PIN = 2;     // these two must be able to interrupt
const int ENCODER_B_PIN = 3;
const int INDEX_PIN = -1;        // one pulse a turn, if there is one; else -1
const float COUNTS_PER_TURN = 4096.0;   // of the drum: encoder lines * 4 * gear
const float DRUM_MM = 95.0;             // diameter
const float FULL_MM_S = 230.0;          // speed at full duty, roughly
// ----------------------------------------------------------------------------------------------

const float MM_PER_COUNT = 3.14159265 * DRUM_MM / COUNTS_PER_TURN;
const float PROPORTIONAL = 0.5;         // share of an error that is answered at once
const float INTEGRAL_HZ = 5.0;          // share that is answered in a second
const unsigned long LOOP_US = 5000;
const unsigned long WATCHDOG_MS = 500;
const unsigned long STALLED_MS = 1000;
const int WINDOW = 20;                  // loops over which speed is measured: 0.1 s

volatile long counts = 0, zero = 0;  // zero: the count at the index pulse
volatile bool indexed = false;

bool turning = false;
const char *fault = "ok";
float aim = 0, summed = 0, speed = 0;
long past[WINDOW];
int newest = 0;
unsigned long last_loop_us = 0, heard_ms = 0, moved_ms = 0;
char line[64];
int length = 0;

void onA() { counts += digitalRead(ENCODER_A_PIN) == digitalRead(ENCODER_B_PIN) ? -1 : 1; }
void onB() { counts += digitalRead(ENCODER_A_PIN) == digitalRead(ENCODER_B_PIN) ? 1 : -1; }

void onIndex() {
  if (!indexed) zero = counts;  // position is told from the first pulse on; speed needs all counts
  indexed = true;
}

long countsNow() {
  noInterrupts();
  long now = counts;
  interrupts();
  return now;
}

void drive(float duty) {
  if (duty > 1) duty = 1;
  if (duty < -1) duty = -1;
  digitalWrite(DIRECTION_PIN, duty < 0 ? HIGH : LOW);
  analogWrite(PWM_PIN, (int)(255 * (duty < 0 ? -duty : duty) + 0.5));
}

void halt(const char *why) {
  turning = false;
  aim = summed = 0;
  fault = why;
  drive(0);
}

void begin(float mmPerSecond) {
  if (strcmp(fault, "ok") != 0) return;  // not before 'clear'
  if (!turning) moved_ms = millis();
  turning = true;
  aim = mmPerSecond;
}

void setup() {
  pinMode(PWM_PIN, OUTPUT);
  pinMode(DIRECTION_PIN, OUTPUT);
  drive(0);
  pinMode(ENCODER_A_PIN, INPUT_PULLUP);
  pinMode(ENCODER_B_PIN, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(ENCODER_A_PIN), onA, CHANGE);
  attachInterrupt(digitalPinToInterrupt(ENCODER_B_PIN), onB, CHANGE);
  if (INDEX_PIN >= 0) {
    pinMode(INDEX_PIN, INPUT_PULLUP);
    attachInterrupt(digitalPinToInterrupt(INDEX_PIN), onIndex, RISING);
  }
  Serial.begin(115200);
  last_loop_us = micros();
}

unsigned int crc16(const char *from, const char *to) {
  unsigned long crc = 0;
  for (; from < to; from++) {
    crc ^= (unsigned long)(byte)*from << 8;
    for (int bit = 0; bit < 8; bit++) crc = (crc & 0x8000UL ? crc << 1 ^ 0x1021UL : crc << 1) & 0xFFFFUL;
  }
  return (unsigned int)crc;
}

void say(const char *text) {
  Serial.print(text);
  Serial.print('*');
  Serial.print((long)crc16(text, text + strlen(text)));
  Serial.print('\n');
}

void sayValue(const char *verb, float value) {
  char number[24], text[48];
  dtostrf(value, 1, 5, number);
  snprintf(text, sizeof text, "%s %s", verb, number);
  say(text);
}

void sayState() {
  char position[24], now[24], text[64];
  if (INDEX_PIN < 0 || indexed) dtostrf((countsNow() - zero) * MM_PER_COUNT, 1, 4, position);
  else strcpy(position, "unknown");  // counted from power-on, which says nothing of the angle
  dtostrf(speed, 1, 3, now);
  snprintf(text, sizeof text, "state %s %s %s", position, now, fault);
  say(text);
}

void obey(char *text) {
  float value = 0;
  char *space = strchr(text, ' ');
  if (space) {
    *space = 0;
    value = atof(space + 1);
  }
  if (!strcmp(text, "speed") && space) { begin(value); sayValue(text, value); }
  else if (!strcmp(text, "stop")) { halt(fault); say("stop"); }
  else if (!strcmp(text, "clear")) { fault = "ok"; say("clear"); }
  else if (!strcmp(text, "state")) sayState();
  else if (!strcmp(text, "hello")) say("hello");
  else say("what");
}

void heard() {
  char *star = strrchr(line, '*');
  if (!star) return;
  if (strtoul(star + 1, 0, 10) != crc16(line, star)) return;
  *star = 0;
  heard_ms = millis();
  obey(line);
}

void control() {
  long now = countsNow();
  newest = (newest + 1) % WINDOW;
  speed = (now - past[newest]) * MM_PER_COUNT * 1e6 / ((float)WINDOW * LOOP_US);
  past[newest] = now;
  if (!turning) return;
  if (millis() - heard_ms > WATCHDOG_MS) { halt("watchdog"); return; }
  if (speed != 0 || aim == 0) moved_ms = millis();
  if (millis() - moved_ms > STALLED_MS) { halt("stalled"); return; }
  float error = aim - speed;
  float next = summed + INTEGRAL_HZ * error * LOOP_US * 1e-6;
  float wanted = aim + PROPORTIONAL * error + next;
  if (wanted < FULL_MM_S && wanted > -FULL_MM_S) summed = next;
  drive(wanted / FULL_MM_S);
}

void loop() {
  while (Serial.available()) {
    char c = (char)Serial.read();
    if (c == '\n' || length >= (int)sizeof line - 1) {
      line[length] = 0;
      length = 0;
      if (c == '\n') heard();
    } else if (c != '\r') {
      line[length++] = c;
    }
  }
  if (micros() - last_loop_us >= LOOP_US) {
    last_loop_us += LOOP_US;
    control();
  }
}
