/* Loaded before libc, lets calls below a folder fail, or a signal come in the middle of them.

FAULT_FOLDER  where; without it nothing is changed
FAULT_CALL    write, open (for writing), rename, mkdir, link, close (of what was written) or fsync
FAULT_NUMBER  which of them, from 1; a full disk (ENOSPC) stays full from there on
FAULT_ERRNO   of the failure; below zero it is the signal that the process gets instead
FAULT_LOG     file that gets a line with the name of each such call
*/
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <unistd.h>

static int calls;

static int fails(const char *call, const char *path)
{
    const char *folder = getenv("FAULT_FOLDER"), *log = getenv("FAULT_LOG");
    const char *wanted = getenv("FAULT_CALL");
    if (!folder || !path || strncmp(path, folder, strlen(folder)))
        return 0;
    if (log) {
        int fd = syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0600);
        syscall(SYS_write, fd, call, strlen(call));
        syscall(SYS_write, fd, "\n", 1);
        syscall(SYS_close, fd);
    }
    if (!wanted || strcmp(call, wanted))
        return 0;
    int count = __sync_add_and_fetch(&calls, 1), number = atoi(getenv("FAULT_NUMBER"));
    int error = atoi(getenv("FAULT_ERRNO"));
    if (error < 0 && count == number)
        kill(getpid(), -error);
    if (error < 0 || !(count == number || (error == ENOSPC && count > number)))
        return 0;
    errno = error;
    return 1;
}

static const char *path_of(int fd, const char *name, char *buffer)
{
    char link[64];
    if (name && name[0] == '/')
        return name;
    snprintf(link, sizeof link, fd == AT_FDCWD ? "/proc/self/cwd" : "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, buffer, PATH_MAX - 1);
    if (length < 0)
        return NULL;
    buffer[length] = 0;
    if (name)
        snprintf(buffer + length, PATH_MAX - length, "/%s", name);
    return buffer;
}

#define REAL(type, name, ...) ((type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, #name))
#define FAILS(call, fd, name) (fails(call, path_of(fd, name, (char[PATH_MAX]){0})))

ssize_t write(int fd, const void *data, size_t size)
{
    return FAILS("write", fd, NULL) ? -1
        : REAL(ssize_t, write, int, const void *, size_t)(fd, data, size);
}

#define PWRITE(name)                                                                     \
    ssize_t name(int fd, const void *data, size_t size, off_t place)                     \
    {                                                                                    \
        return FAILS("write", fd, NULL) ? -1                                             \
            : REAL(ssize_t, name, int, const void *, size_t, off_t)(fd, data, size, place); \
    }
PWRITE(pwrite)
PWRITE(pwrite64)

#define SENDFILE(name)                                                                   \
    ssize_t name(int to, int from, off_t *place, size_t size)                            \
    {                                                                                    \
        return FAILS("write", to, NULL) ? -1                                             \
            : REAL(ssize_t, name, int, int, off_t *, size_t)(to, from, place, size);     \
    }
SENDFILE(sendfile)
SENDFILE(sendfile64)

size_t fwrite(const void *data, size_t size, size_t number, FILE *file)
{
    return FAILS("write", fileno(file), NULL) ? 0
        : REAL(size_t, fwrite, const void *, size_t, size_t, FILE *)(data, size, number, file);
}

static int opened(const char *name, int folder, const char *path, int flags, int mode)
{
    if ((flags & (O_WRONLY | O_RDWR | O_CREAT)) && FAILS("open", folder, path))
        return -1;
    return ((int (*)(int, const char *, int, ...))dlsym(RTLD_NEXT, name))(folder, path, flags, mode);
}

#define OPEN(name, at, ...)                                                              \
    int name(__VA_ARGS__ const char *path, int flags, ...)                               \
    {                                                                                    \
        va_list rest;                                                                    \
        va_start(rest, flags);                                                           \
        int mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(rest, int) : 0;              \
        va_end(rest);                                                                    \
        return opened("openat64", at, path, flags, mode);                                \
    }
OPEN(open, AT_FDCWD, )
OPEN(open64, AT_FDCWD, )
#define FOLDER int folder,
OPEN(openat, folder, FOLDER)
OPEN(openat64, folder, FOLDER)

int mkdir(const char *path, mode_t mode)
{
    return FAILS("mkdir", AT_FDCWD, path) ? -1 : REAL(int, mkdir, const char *, mode_t)(path, mode);
}

int rename(const char *old, const char *new)
{
    return FAILS("rename", AT_FDCWD, old) ? -1
        : REAL(int, rename, const char *, const char *)(old, new);
}

int renameat2(int from, const char *old, int to, const char *new, unsigned flags)
{
    return FAILS("rename", from, old) ? -1
        : REAL(int, renameat2, int, const char *, int, const char *, unsigned)(
            from, old, to, new, flags);
}

int link(const char *old, const char *new)
{
    return FAILS("link", AT_FDCWD, new) ? -1
        : REAL(int, link, const char *, const char *)(old, new);
}

int linkat(int from, const char *old, int to, const char *new, int flags)
{
    return FAILS("link", to, new) ? -1
        : REAL(int, linkat, int, const char *, int, const char *, int)(from, old, to, new, flags);
}

int fsync(int fd)
{
    return FAILS("fsync", fd, NULL) ? -1 : REAL(int, fsync, int)(fd);
}

int close(int fd) /* of a file that was written: a disk may say so late that it has no room */
{
    struct stat status;
    int is_written = !fstat(fd, &status) && S_ISREG(status.st_mode)
        && (fcntl(fd, F_GETFL) & (O_WRONLY | O_RDWR));
    int failed = is_written && FAILS("close", fd, NULL), error = errno;
    int closed = REAL(int, close, int)(fd);
    if (!failed) /* the descriptor is gone in any case */
        return closed;
    errno = error;
    return -1;
}
