"""One shaking as loggers write it: texts of files, each made from the same samples, and its rms in an octave.

The base shakes with 30 Hz and some noise, at 200 samples per second, with gravity on the z axis.
"""

import json
import math

import numpy as np

G = 9.80665
RATE, COUNT = 200.0, 1200
BAND = (22.0971, 44.1942)  # Hz, the octave about 31.25 Hz


def axes():
    """The three axes in g, shape (3, COUNT), without an offset but for gravity on z."""
    rng = np.random.default_rng(58)
    t = np.arange(COUNT) / RATE
    x, y, noise = 0.03 * rng.standard_normal((3, COUNT))
    return np.array([x, y, 1.0 + 0.35 * np.sin(2 * math.pi * 30.0 * t) + noise])


Z = axes()[2]
T = np.arange(COUNT) / RATE


def octave_rms(values, rate):
    """The rms of samples in `BAND`, from their Fourier series."""
    n = len(values)
    f = np.fft.rfftfreq(n, 1.0 / rate)
    power = 2.0 * np.abs(np.fft.rfft(values)) ** 2 / n**2
    return math.sqrt(power[(f > BAND[0]) & (f <= BAND[1])].sum())


RIGHT = octave_rms(Z - Z.mean(), RATE)


def rows(times, values=Z, sep=",", form="{:.4f}", sign=".", tail=""):
    """Lines of a time, as a text, and a value each."""
    pairs = zip(times, values, strict=True)
    return "".join(f"{t}{sep}{form.format(v).replace('.', sign)}{tail}\n" for t, v in pairs)


def clock(k, hour=11, zone=""):
    """The time of day of sample k, that begins 5 s before noon."""
    seconds = 55.0 + k / RATE
    minute = 59 + int(seconds // 60)
    return f"{hour + minute // 60:02d}:{minute % 60:02d}:{seconds % 60:06.3f}{zone}"


def halves(k):
    """The time of day of sample k with AM or PM."""
    return clock(k) + (" AM" if 55.0 + k / RATE < 60.0 else " PM")


def three(scale=1.0, sep=",", times=None):
    """Lines of a time and three axes."""
    x, y, z = scale * axes()
    stamps = [f"{t:.3f}" for t in T] if times is None else times
    lines = zip(stamps, x, y, z, strict=True)
    return "".join(sep.join([str(t), *(f"{a:.6f}" for a in line)]) + "\n" for t, *line in lines)


def seconds(form="{:.3f}", factor=1.0, begin=0.0, sign="."):
    """The times of all samples as texts."""
    return [form.format(begin + factor * t).replace(".", sign) for t in T]


MILLIS = [str(5123 + 5 * k) for k in range(COUNT)]
ROLLING = [str((2**32 - 3_000_000 + 5000 * k) % 2**32) for k in range(COUNT)]
DATES = [f"04/10/2031,{clock(k)[:8]},{clock(k)[8:]}000000" for k in range(COUNT)]
LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\tOne\n***End_of_Header***\t\n"
    "\t\nChannels\t1\t\nY_Unit_Label\tg\t\nX_Dimension\tTime\t\nDelta_X\t0.005000\t\n"
    "***End_of_Header***\t\t\nX_Value\tAcceleration\tComment\n"
)
SCOPE = (
    "Format,2.0E,\nVertical Units,V,\nHorizontal Units,S,\nSampling Period,5.000E-03,\n"
    "Mode,Detail,\nWaveform Data,\n"
)

# Texts of files that state what they are: each is read at once, with the axis where there are several.
STATED = {
    "epoch in ms": (
        "timestamp,az (g)\n" + rows([1930000000000 + 5 * k for k in range(COUNT)]),
        None,
    ),
    "epoch in us": (
        "epoch,az (g)\n" + rows([1930000000000000 + 5000 * k for k in range(COUNT)]),
        None,
    ),
    "epoch in s": ("timestamp,az (g)\n" + rows(seconds("{:.6f}", begin=1.93e9)), None),
    "days of a spreadsheet": ("time,az (g)\n" + rows(seconds("{:.12f}", 1 / 86400, 47000.5)), None),
    "millis": ("TIME,x (m/s^2),y (m/s^2),z (m/s^2)\n" + three(G, times=MILLIS), "z"),
    "micros that roll over": ("micros,az (g)\n" + rows(ROLLING), None),
    "micros by its unit": ("t (us),az (g)\n" + rows(ROLLING), None),
    "seconds of a minute": ("time (s),az (g)\n" + rows([f"{(55 + t) % 60:.3f}" for t in T]), None),
    "US dates": (
        "Timestamp,Ax (g),Ay (g),Az (g)\n"
        + three(times=[f"04/10/2031 {halves(k)}" for k in range(COUNT)]),
        "z",
    ),
    "three columns of a clock": ("Date,Time,Fractional Seconds,Az (g)\n" + rows(DATES), None),
    "two columns of a clock": (
        "Date,Time,Az (g)\n" + rows([f"2031-04-10,{clock(k)}" for k in range(COUNT)]),
        None,
    ),
    "over midnight": (
        "Date,Time,Az (g)\n"
        + rows(
            [f"{30 + (k > 999)}.12.2031,{clock(k, 23).replace('24:', '00:')}" for k in range(COUNT)]
        ),
        None,
    ),
    "a status": ("time (s),az (g),status,sensor\n" + rows(seconds(), tail=",OK,A"), None),
    "a header again": (
        "time (s),z (g)\n"
        + rows(seconds()[:600], Z[:600])
        + "time (s),z (g)\n"
        + rows(seconds()[600:], Z[600:]),
        None,
    ),
    "an end": ("BEGIN DATA\ntime (s),z (g)\n" + rows(seconds()) + "END\n", None),
    "a commented header": ("#time (s),z (mm/s^2)\n" + rows(seconds(), 1000 * G * Z), None),
    "commas in numbers and between": (
        "; Sample rate: 200 Hz\nTime(s), Z(g)\n" + rows(seconds(sign=",")),
        None,
    ),
    "commas everywhere": ("Time(s),Z(g)\n" + rows(seconds(sign=","), sign=","), None),
    "LabVIEW": (LVM + rows(seconds("{:.6f}"), sep="\t", tail="\t"), None),
    "LabVIEW without times": (
        LVM.replace("One", "No") + rows([""] * COUNT, sep="\t", tail="\t"),
        None,
    ),
    "a range in brackets": ('"Time (s)","Z (40g)"\n' + rows(seconds()), None),
    "units in a row": ("Zeit;Kanal 1\ns;g\n" + rows(seconds(sign=","), sep=";", sign=","), None),
    "milliseconds behind a comma": (
        "time,z (g)\n" + rows([f"2031-04-10 {clock(k)}".replace(".", ",") for k in range(COUNT)]),
        None,
    ),
    "minutes of an hour": ("Time,z (g)\n" + rows([clock(k)[3:] for k in range(COUNT)]), None),
    "milliseconds behind a colon": (
        "Time,z (g)\n" + rows([f"{clock(k)[:8]}:{clock(k)[9:]}" for k in range(COUNT)]),
        None,
    ),
    "sections with a star": (  # as MSR loggers write them
        "*CREATOR\nMSR 6.04\n*STARTTIME\n2031-04-10;11:59:55;\n*MODUL\nMSR165;MSR165;\n"
        "*TIMEDELAY\n0\n*CHANNEL\nTIME;ACC x;ACC y;ACC z;\n*UNIT\n;G;G;G;\n"
        "*LIMITS\n;0.00;0.00;0.00\n*CALIBRATION\n;;;\n*DATA\n"
        + three(sep=";", times=[f"2031-04-10 {clock(k)}" for k in range(COUNT)]).replace(
            "\n", ";\n"
        ),
        "z",
    ),
    "kinds of values below the units": (  # TOA5
        '"TOA5","CR6","CR6","12","CR6.Std.10","CPU:a.CR6","4","Vib"\n'
        '"TIMESTAMP","RECORD","AccX","AccY","AccZ"\n"TS","RN","g","g","g"\n'
        '"","","Smp","Smp","Smp"\n'
        + three(times=[f'"2031-04-10 {clock(k)}",{k}' for k in range(COUNT)]),
        "AccZ",
    ),
    "a timestamp inside a name": (
        '"sep=\t"\nS_5E2C_Timestamp_Unix_CAL\tS_X_CAL\tS_Y_CAL\tS_Z_CAL\t\nms\tg\tg\tg\t\n'
        + three(sep="\t", times=seconds("{:.4f}", 1e3, 1.93e12)),
        "S_Z_CAL",
    ),
    "settings, counters and times": (
        "Header Size: 20\nX-axis size: 1200\nX-axis unit: s\nX-axis delta: 5.0E-3\n"
        "Y-axis unit: m/s²\n\n"
        + rows([f"{k}\t{t:.8E}" for k, t in enumerate(T)], G * Z, sep="\t", form="{:.6E}"),
        None,
    ),
    "carriage returns": (("time (s),z (g)\n" + rows(seconds())).replace("\n", "\r"), None),
    "a summary": ("time (s),z (g)\n" + rows(seconds()) + "\nMin,0.55\nMax,1.45\nMean,1.0\n", None),
    "JSON lines": (
        "".join(f'{{"t": {t:.3f}, "az (g)": {z:.4f}}}\n' for t, z in zip(T, Z, strict=True)),
        None,
    ),
    "a JSON array": (
        json.dumps([{"ts": 1930000000000 + 5 * k, "az_g": round(z, 4)} for k, z in enumerate(Z)]),
        None,
    ),
    "start and step in columns": (
        f"X0 (s);dX (s);az (g)\n0;0.005;{Z[0]:.4f}\n" + "".join(f";;{z:.4f}\n" for z in Z[1:]),
        None,
    ),
    "start and step in each row, a row of units": (
        "X0,dX,az\nms,ms,g\n" + "".join(f"0,5,{z:.4f}\n" for z in Z),
        None,
    ),
    "start and step in one column": (
        f"X0/dX (s);az (g)\n0;{Z[0]:.4f}\n0.005;{Z[1]:.4f}\n"
        + "".join(f";{z:.4f}\n" for z in Z[2:]),
        None,
    ),
    "start and step in one column, no unit": (
        f"X0/dX;az (g)\n0;{Z[0]:.4f}\n5;{Z[1]:.4f}\n" + "".join(f";{z:.4f}\n" for z in Z[2:]),
        None,
    ),
    "times below start and step": (
        "X0/dX,az (g)\n" + "".join(f"{t:.3f},{z:.4f}\n" for t, z in zip(T, Z, strict=True)),
        None,
    ),
    "a rate above": ("Sampling rate (kHz): 0.2\nz (g)\n" + "".join(f"{z:.4f}\n" for z in Z), None),
}

# Texts that leave a fact open: the option that is asked for, and what makes the file clean.
ASKED = {
    "letters before numbers": (
        rows([f"t:{t:.3f}" for t in T], form="x: 0.1 y: 0.2 z:{:.4f}", sep=" "),
        "--axis z",
        "--unit",
        "g",
    ),
    "no unit": ("time (s),x,y,z\n" + three(), "--axis z", "--unit", "g"),
    "no unit, m/s^2": ("TIME,X,Y,Z\n" + three(G, times=MILLIS), "--axis z", "--unit", "m/s^2"),
    "no names": (three(), "--axis z", "--unit", "g"),
    "no names, one axis": (rows(seconds()), "", "--unit", "g"),
    "volts of an oscilloscope": (
        SCOPE + rows(seconds("{:.6e}", begin=-3.0), Z - 1.0, form="{:.5e}", tail=","),
        "",
        "--unit",
        "1 g",
    ),
    "numbered samples of an oscilloscope": (
        "X,CH1,Start,Increment\nSequence,Volt,-6.0,5e-3\n" + rows(range(COUNT), Z - 1.0, tail=",,"),
        "",
        "--unit",
        "1 g",
    ),
    "counts": (
        "time (s),z (counts)\n" + rows(seconds(), np.round(Z / 4.88e-4), form="{:.0f}"),
        "",
        "--unit",
        "0.488 mg",
    ),
    "ms or us": ("time,z (g)\n" + rows(seconds("{:.0f}", 4e3)), "", "--time-unit", "us"),
    "a counter": (
        "Sample,z (g)\n" + rows(np.delete(np.arange(COUNT), 400), np.delete(Z, 400)),
        "",
        "--rate",
        "200",
    ),
    "a serial monitor": (
        "".join(
            f"{clock(k)} -> {x:.4f}\t{y:.4f}\t{z:.4f}\n" for k, (x, y, z) in enumerate(axes().T)
        ),
        "--axis z",
        "--unit",
        "g",
    ),
    "a rate behind slashes": (
        "// Update Rate: 200.0Hz\nPacketCounter\tAcc_X\tAcc_Y\tAcc_Z\n"
        + three(G, sep="\t", times=[str((65000 + k) % 65536) for k in range(COUNT)]),
        "--axis Acc_Z",
        "--unit",
        "m/s^2",
    ),
    "a list of names in a comment": (
        ";Title, http://host, X2-2, Kionix\n;SampleRate, 200,Hz\n;Headers, time,Ax,Ay,Az\n"
        + three(1.0 / 0.488),
        "--axis Az",
        "--unit",
        "0.488 g",
    ),
    "JSON lines without a unit": (
        "".join(f'{{"t": {t:.3f}, "a": {z:.4f}}}\n' for t, z in zip(T, Z, strict=True)),
        "",
        "--unit",
        "g",
    ),
    "two sensors": (
        "time (s),sensor,z (g)\n"
        + "".join(f"{t:.3f},A,{z:.4f}\n{t:.3f},B,{-z:.4f}\n" for t, z in zip(T, Z, strict=True)),
        "",
        "--where",
        "sensor=A",
    ),
    "a restart": (
        "time (s),z (g)\n" + rows(seconds()[:100], Z[:100]) + rows(seconds()),
        "",
        "--recording",
        "2",
    ),
}
