/* Answers open, ioctl, mmap and poll for paths with /fakecam/ in them, as a driver of V4L2 does.
 * The path says what happens: /x/fakecam/video0?fps=90&drop=3,7-9&unplug=100. It is built from the
 * kernel's own header, so that structures and numbers of ours are checked against it. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

enum { CAMERAS = 4, BUFFERS = 8, ROOM = 1 << 20 };
struct control { uint32_t id; int32_t value, least, most; const char *name; };
struct camera {
  int fd;
  char path[1024];
  uint32_t format, width, height;
  double fps, start;
  int streaming, n_buffers, gone;
  long next;
  unsigned char *memory[BUFFERS];
  int queued[BUFFERS], n_queued;
  struct v4l2_buffer done[BUFFERS];
  int n_done;
  struct control controls[10];
};
static struct camera cameras[CAMERAS];
static const struct control CONTROLS[10] = {
    {V4L2_CID_EXPOSURE_AUTO, 3, 0, 3, "Auto Exposure"},
    {V4L2_CID_EXPOSURE_ABSOLUTE, 157, 1, 500, "Exposure Time, Absolute"},
    {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 1, 0, 1, "Exposure, Dynamic Framerate"},
    {V4L2_CID_GAIN, 16, 0, 100, "Gain"},
    {V4L2_CID_AUTO_WHITE_BALANCE, 1, 0, 1, "White Balance, Automatic"},
    {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 4600, 2800, 6500, "White Balance Temperature"},
    {V4L2_CID_BRIGHTNESS, 0, -64, 64, "Brightness"},
};

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + t.tv_nsec * 1e-9;
}

/* The text after KEY= in the path; NULL without. */
static const char *said(struct camera *c, const char *key) {
  char *found = strchr(c->path, '?');
  size_t n = strlen(key);
  while (found) {
    if (!strncmp(found + 1, key, n) && found[n + 1] == '=') return found + n + 2;
    found = strchr(found + 1, '&');
  }
  return NULL;
}
static double number(struct camera *c, const char *key, double without) {
  const char *text = said(c, key);
  return text ? atof(text) : without;
}
/* Whether a list such as 3,7-9 holds a number. */
static int lists(struct camera *c, const char *key, long n) {
  const char *text = said(c, key);
  while (text && *text && *text != '&') {
    char *end;
    long a = strtol(text, &end, 10), b = a;
    if (*end == '-') b = strtol(end + 1, &end, 10);
    if (n >= a && n <= b) return 1;
    text = *end == ',' ? end + 1 : NULL;
  }
  return 0;
}

static struct camera *of(int fd) {
  for (int i = 0; fd > 0 && i < CAMERAS; i++)
    if (cameras[i].fd == fd) return &cameras[i];
  return NULL;
}

static int fake_open(const char *path) {
  int (*real)(const char *, int, ...) = dlsym(RTLD_NEXT, "open");
  for (int i = 0; i < CAMERAS; i++) {
    struct camera *c = &cameras[i];
    if (c->fd > 0) continue;
    memset(c, 0, sizeof *c);
    snprintf(c->path, sizeof c->path, "%s", path);
    if (said(c, "absent")) { errno = ENOENT; return -1; }
    if (said(c, "denied")) { errno = EACCES; return -1; }
    memcpy(c->controls, CONTROLS, sizeof CONTROLS);
    c->format = V4L2_PIX_FMT_YUYV; c->width = 640; c->height = 480; c->fps = 30;
    return c->fd = real("/dev/null", O_RDWR | O_CLOEXEC);
  }
  errno = EMFILE;
  return -1;
}
#define OPEN(NAME, ARGS, CALL)                                            \
  int NAME ARGS {                                                         \
    if (strstr(path, "/fakecam/")) return fake_open(path);                \
    int (*real) ARGS = dlsym(RTLD_NEXT, #NAME);                           \
    va_list list; va_start(list, flags); int mode = va_arg(list, int); va_end(list); \
    return real CALL;                                                     \
  }
OPEN(open, (const char *path, int flags, ...), (path, flags, mode))
OPEN(open64, (const char *path, int flags, ...), (path, flags, mode))
OPEN(openat, (int at, const char *path, int flags, ...), (at, path, flags, mode))
OPEN(openat64, (int at, const char *path, int flags, ...), (at, path, flags, mode))

int close(int fd) {
  struct camera *c = of(fd);
  if (c) c->fd = 0;
  int (*real)(int) = dlsym(RTLD_NEXT, "close");
  return real(fd);
}

/* The content of a frame: from the film (lengths and JPEGs in turn), else its number. */
static uint32_t fill(struct camera *c, long n, unsigned char *to) {
  if (lists(c, "repeat", n)) n--;
  const char *film = said(c, "film");
  if (film) {
    char path[512] = "";
    snprintf(path, sizeof path, "%.*s", (int)strcspn(film, "&"), film);
    FILE *file = fopen(path, "rb");
    uint32_t length = 0, first = 0;
    if (file) {
      for (long i = 0;; i++) {
        if (fread(&length, 4, 1, file) != 1) { n -= i; i = 0; rewind(file); if (fread(&length, 4, 1, file) != 1) break; }
        if (i == n) { first = (uint32_t)fread(to, 1, length, file); break; }
        fseek(file, length, SEEK_CUR);
      }
      fclose(file);
    }
    return first;
  }
  return (uint32_t)sprintf((char *)to, "\xff\xd8%08ld a frame\xff\xd9", n);
}

static void make(struct camera *c) {
  long n = c->next++;
  if (lists(c, "drop", n)) return;
  if (c->n_queued == 0) return; /* nowhere to put it: lost, as by a driver */
  int index = c->queued[0];
  memmove(c->queued, c->queued + 1, --c->n_queued * sizeof(int));
  struct v4l2_buffer b = {.index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
  double t = c->start + n / c->fps + (lists(c, "late", n) ? 0.9 / c->fps : 0);
  b.timestamp.tv_sec = (long)t;
  b.timestamp.tv_usec = (long)((t - (long)t) * 1e6);
  b.sequence = (uint32_t)n;
  b.bytesused = fill(c, n, c->memory[index]);
  b.flags = said(c, "noclock") ? 0 : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  if (lists(c, "damaged", n)) b.flags |= V4L2_BUF_FLAG_ERROR;
  if (lists(c, "damaged", n) || lists(c, "torn", n)) b.bytesused /= 2;
  b.memory = V4L2_MEMORY_MMAP;
  c->done[c->n_done++] = b;
}
static void advance(struct camera *c) {
  if (!c->streaming || lists(c, "stall", c->next)) return;
  if (!said(c, "paced"))
    while (c->n_done == 0 && c->n_queued && !lists(c, "unplug", c->next) && !lists(c, "stall", c->next)) make(c);
  else
    while (c->start + c->next / c->fps <= now() && !lists(c, "unplug", c->next)) make(c);
  if (c->n_done == 0 && lists(c, "unplug", c->next)) c->gone = 1;
}

#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
int poll(struct pollfd *fds, nfds_t n, int timeout) {
  struct camera *c = n == 1 ? of(fds[0].fd) : NULL;
  if (!c) {
    int (*real)(struct pollfd *, nfds_t, int) = dlsym(RTLD_NEXT, "poll");
    return real(fds, n, timeout);
  }
  double until = now() + timeout / 1000.0;
  for (;;) {
    advance(c);
    fds[0].revents = c->gone ? POLLERR | POLLHUP : c->n_done ? POLLIN : 0;
    if (fds[0].revents) return 1;
    if (now() > until) return 0;
    usleep(500);
  }
}

static void *map(void *at, size_t length, int protection, int flags, int fd, off_t offset, const char *name) {
  struct camera *c = of(fd);
  void *(*real)(void *, size_t, int, int, int, off_t) = dlsym(RTLD_NEXT, name);
  if (!c) return real(at, length, protection, flags, fd, offset);
  void *memory = real(NULL, length, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  return c->memory[offset / ROOM] = memory;
}
void *mmap(void *at, size_t n, int p, int f, int fd, off_t o) { return map(at, n, p, f, fd, o, "mmap"); }
void *mmap64(void *at, size_t n, int p, int f, int fd, off64_t o) { return map(at, n, p, f, fd, o, "mmap64"); }

static int offers(struct camera *c, uint32_t format) {
  const char *list = said(c, "formats");
  char name[5] = {0};
  memcpy(name, &format, 4);
  const char *found = strstr(list ? list : "YUYV,MJPG", name);
  return found != NULL;
}
static struct control *control(struct camera *c, uint32_t id) {
  for (int i = 0; i < 10; i++)
    if (c->controls[i].id == id && id && !(said(c, "nocontrols"))) return &c->controls[i];
  return NULL;
}

static int answer(struct camera *c, unsigned long request, void *argument) {
  if (c->gone) return ENODEV;
  switch (request) {
    case VIDIOC_QUERYCAP: {
      struct v4l2_capability *a = argument;
      memset(a, 0, sizeof *a);
      strcpy((char *)a->driver, "fake"); strcpy((char *)a->card, "A camera that is none");
      a->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
      a->device_caps = said(c, "metadata") ? V4L2_CAP_META_CAPTURE : V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      struct v4l2_fmtdesc *a = argument;
      uint32_t all[] = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_GREY}, n = 0;
      for (int i = 0; i < 3; i++)
        if (offers(c, all[i]) && n++ == a->index) { a->pixelformat = all[i]; return 0; }
      return EINVAL;
    }
    case VIDIOC_ENUM_FRAMESIZES: {
      struct v4l2_frmsizeenum *a = argument;
      if (a->index > 1) return EINVAL;
      a->type = V4L2_FRMSIZE_TYPE_DISCRETE;
      a->discrete.width = a->index ? 320 : 640; a->discrete.height = a->index ? 240 : 480;
      return 0;
    }
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      struct v4l2_frmivalenum *a = argument;
      if (a->index > 1) return EINVAL;
      a->type = V4L2_FRMIVAL_TYPE_DISCRETE;
      a->discrete.numerator = 1;
      a->discrete.denominator = a->index ? 30 : a->pixel_format == V4L2_PIX_FMT_MJPEG ? 90 : 60;
      return 0;
    }
    case VIDIOC_G_FMT: {
      struct v4l2_pix_format *a = &((struct v4l2_format *)argument)->fmt.pix;
      a->pixelformat = c->format; a->width = c->width; a->height = c->height;
      return 0;
    }
    case VIDIOC_S_FMT: {
      if (said(c, "busy")) return EBUSY;
      struct v4l2_pix_format *a = &((struct v4l2_format *)argument)->fmt.pix;
      if (!offers(c, a->pixelformat)) a->pixelformat = V4L2_PIX_FMT_YUYV;
      if (said(c, "raw")) a->pixelformat = V4L2_PIX_FMT_YUYV;
      if (a->width != 320) { a->width = 640; a->height = 480; }
      a->sizeimage = ROOM;
      c->format = a->pixelformat; c->width = a->width; c->height = a->height;
      return 0;
    }
    case VIDIOC_S_PARM: {
      if (said(c, "norates")) return ENOTTY;
      struct v4l2_fract *a = &((struct v4l2_streamparm *)argument)->parm.capture.timeperframe;
      c->fps = number(c, "fps", (double)a->denominator / a->numerator);
      return 0;
    }
    case VIDIOC_G_PARM: {
      struct v4l2_fract *a = &((struct v4l2_streamparm *)argument)->parm.capture.timeperframe;
      a->numerator = 1000; a->denominator = (uint32_t)(c->fps * 1000 + 0.5);
      return 0;
    }
    case VIDIOC_QUERYCTRL: {
      struct v4l2_queryctrl *a = argument;
      struct control *found = control(c, a->id);
      if (!found) return EINVAL;
      strcpy((char *)a->name, found->name);
      a->minimum = found->least; a->maximum = found->most; a->step = 1; a->flags = 0;
      return 0;
    }
    case VIDIOC_G_CTRL:
    case VIDIOC_S_CTRL: {
      struct v4l2_control *a = argument;
      struct control *found = control(c, a->id);
      if (!found) return EINVAL;
      if (request == VIDIOC_G_CTRL) { a->value = found->value; return 0; }
      if (a->id == V4L2_CID_EXPOSURE_ABSOLUTE && control(c, V4L2_CID_EXPOSURE_AUTO)->value != V4L2_EXPOSURE_MANUAL)
        return EIO; /* as uvcvideo does of a control that is automatic */
      if (said(c, "stubborn") && a->id == V4L2_CID_EXPOSURE_AUTO) return EIO;
      found->value = a->value < found->least ? found->least : a->value > found->most ? found->most : a->value;
      return 0;
    }
    case VIDIOC_REQBUFS: {
      struct v4l2_requestbuffers *a = argument;
      if (a->count > BUFFERS) a->count = BUFFERS;
      c->n_buffers = (int)a->count; c->n_queued = c->n_done = 0;
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      struct v4l2_buffer *a = argument;
      if ((int)a->index >= c->n_buffers) return EINVAL;
      a->length = ROOM; a->m.offset = a->index * ROOM;
      a->flags = said(c, "noclock") ? 0 : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
      return 0;
    }
    case VIDIOC_QBUF: {
      struct v4l2_buffer *a = argument;
      if ((int)a->index >= c->n_buffers || c->n_queued == BUFFERS) return EINVAL;
      c->queued[c->n_queued++] = (int)a->index;
      return 0;
    }
    case VIDIOC_DQBUF: {
      advance(c);
      if (c->gone) return ENODEV;
      if (c->n_done == 0) return EAGAIN;
      *(struct v4l2_buffer *)argument = c->done[0];
      memmove(c->done, c->done + 1, --c->n_done * sizeof c->done[0]);
      return 0;
    }
    case VIDIOC_STREAMON:
      c->streaming = 1; c->start = now(); c->next = 0;
      return 0;
    case VIDIOC_STREAMOFF:
      c->streaming = 0; c->n_queued = c->n_done = 0;
      return 0;
  }
  return ENOTTY;
}

int ioctl(int fd, unsigned long request, ...) {
  va_list list;
  va_start(list, request);
  void *argument = va_arg(list, void *);
  va_end(list);
  struct camera *c = of(fd);
  if (!c) {
    int (*real)(int, unsigned long, ...) = dlsym(RTLD_NEXT, "ioctl");
    return real(fd, request, argument);
  }
  int error = answer(c, request & 0xffffffff, argument);
  if (error) { errno = error; return -1; }
  return 0;
}
