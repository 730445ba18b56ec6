"""The machines that a wheel is built for: the compiler's name of each, its wheel's tag, and ngspice's settings."""

import platform
from dataclasses import dataclass

# of the environment: one of TARGETS; this machine's own where it is not set
VARIABLE = "NGSPICE_TARGET"

# What the systems have of what ngspice's `configure` asks for, as its answers on each would be.
_EVERYWHERE = """ACCESS ACOSH ASINH ATANH CTYPE_H DUP2 ERFC FCNTL_H FLOAT_H GETOPT_H GETOPT_LONG GETCWD INTTYPES_H
ISATTY LIBM LIMITS_H LOCALTIME LOGB MEMSET MODF QSORT SCALBN SNPRINTF STDBOOL_H STDDEF_H STDINT_H STDIO_H STDLIB_H
STRCHR STRDUP STRERROR STRING_H STRRCHR STRSTR STRTOL SYS_STAT_H SYS_TYPES_H TIME UNISTD_H VPRINTF _BOOL"""
_POSIX = """ARPA_INET_H DIRENT_H DIRNAME DLFCN_H ENDPWENT FINITE FORK GETHOSTBYNAME GETRLIMIT GETRUSAGE GETTIMEOFDAY
LIBPTHREAD NETDB_H NETINET_IN_H POPEN PWD_H SCALB SELECT SIGSETJMP SIG_T SOCKET STRINGS_H STRNCASECMP
STRUCT_TM_TM_ZONE SYS_FILE_H SYS_IOCTL_H SYS_PARAM_H SYS_SELECT_H SYS_SOCKET_H SYS_TIME_H SYS_WAIT_H TCGETATTR
TCSETATTR TERMIOS_H TM_ZONE UTIMES VFORK WORKING_FORK WORKING_VFORK"""
_OPTIONS = """CIDER NOINTHELP RFSPICE SHARED_MODULE STDC_HEADERS TIME_WITH_SYS_TIME WITH_PSS XSPICE X_DISPLAY_MISSING
YYTEXT_POINTER"""
_LINUX = (
    "FTIME LIBINTL_H MALLOC_H SYS_TIMEB_H TDESTROY TSEARCH VALUES_H _PROC_MEMINFO __SIGHANDLER_T"
)
_MACOS = "TSEARCH"
_WINDOWS = "GETTIMEOFDAY MALLOC_H SYS_TIMEB_H SYS_TIME_H FTIME DIRENT_H DIRNAME STRNCASECMP STRINGS_H UTIMES"


@dataclass(frozen=True)
class Target:
    """A machine: ``triple`` is the compiler's name of it, ``tag`` the wheel's, ``has`` the HAVE_... of ngspice."""

    triple: str
    tag: str
    library: str
    has: str
    links: tuple[str, ...] = ()

    @property
    def is_windows(self) -> bool:
        """Whether code must be asked for its place in memory, and processes and sockets are another system's."""
        return "windows" in self.triple


_WIN_LINKS = ("-lshlwapi", "-lpsapi", "-lws2_32")
TARGETS = {
    "linux-x86_64": Target(
        "x86_64-linux-gnu.2.28", "manylinux_2_28_x86_64", "libngspice.so", f"{_POSIX} {_LINUX}"
    ),
    "linux-aarch64": Target(
        "aarch64-linux-gnu.2.28", "manylinux_2_28_aarch64", "libngspice.so", f"{_POSIX} {_LINUX}"
    ),
    "macos-x86_64": Target(
        "x86_64-macos.11.0", "macosx_11_0_x86_64", "libngspice.dylib", f"{_POSIX} {_MACOS}"
    ),
    "macos-arm64": Target(
        "aarch64-macos.11.0", "macosx_11_0_arm64", "libngspice.dylib", f"{_POSIX} {_MACOS}"
    ),
    "windows-x86_64": Target(
        "x86_64-windows-gnu", "win_amd64", "ngspice.dll", _WINDOWS, _WIN_LINKS
    ),
}


def this_machine() -> str:
    """The name in TARGETS of the machine that builds; KeyError elsewhere names it."""
    system = {"Darwin": "macos"}.get(platform.system(), platform.system().lower())
    processor = {"AMD64": "x86_64"}.get(platform.machine(), platform.machine())
    return f"{system}-{processor}"


def config(target: Target, version: str) -> str:
    """The file config.h: Debian's options of ngspice as a library, but for OpenMP, which slows small circuits.

    It names no folder that could exist: the library reads no start file but those that its user
    gives it.
    """
    lines = [f"#define HAVE_{name} 1" for name in f"{_EVERYWHERE} {target.has}".split()]
    lines += [f"#define {name} 1" for name in _OPTIONS.split()]
    if not target.is_windows:
        lines += [
            "#define IPC_UNIX_SOCKETS 1",
            "#define HAVE_DECL_ISINF 1",
            "#define HAVE_DECL_ISNAN 1",
        ]
    texts = {"VERSION": version, "PACKAGE_VERSION": version, "SHAREDSPICE_version": version}
    texts |= {"PACKAGE": "ngspice", "PACKAGE_BUGREPORT": "", "LT_OBJDIR": ""}
    texts |= {
        "PACKAGE_STRING": f"ngspice {version}",
        "NGSPICEBUILDDATE": "2023-02-05",
        "NGSPICEBINDIR": "/nonexistent",
    }
    texts |= {"NGSPICEDATADIR": "/nonexistent", "PACKAGE_NAME": "ngspice"}
    lines += [f'#define {name} "{text}"' for name, text in texts.items()]
    lines += ["#define RETSIGTYPE void", "#define OS_COMPILED 6", "#define SELECT_TYPE_ARG1 int"]
    lines += [
        "#define SELECT_TYPE_ARG234 (fd_set *)",
        "#define SELECT_TYPE_ARG5 (struct timeval *)",
    ]
    return "\n".join(lines) + "\n"
