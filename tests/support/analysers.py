"""One impedance as analysers write it: texts of files, each made from the same complex numbers."""

import numpy as np

from tests.support.bench import Truth, impedance_of

TRUTH = Truth(mass=12e-3, f0=91.0, q=35.0, beta=0.03, c=39e-9, loss=0.015)
F = np.linspace(70.0, 115.0, 301)


def measured():
    """The impedance at F with 0.1 % of noise."""
    rng = np.random.default_rng(4294)
    noise = 1e-3 * (rng.standard_normal(len(F)) + 1j * rng.standard_normal(len(F)))
    return impedance_of(TRUTH, F) * (1.0 + noise)


Z = measured()
W = 2 * np.pi * F
Y = 1.0 / Z
SIZE, ANGLE = np.abs(Z), np.degrees(np.angle(Z))
S = (Z - 50.0) / (Z + 50.0)


def table(*columns, sep=",", sign=".", form="{:.9e}"):
    """Rows of numbers."""
    lines = (
        sep.join(form.format(v).replace(".", sign) for v in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join(lines) + "\n"


def traces(parameter, *both):
    """An export of a 4294A with the traces A and B, each with both of its parts."""
    text = f'4294A REV1.11\n"DATE: Jan 25 2031"\n\n"MEASURE PARAMETER: {parameter}"\n"SWEEP TYPE: LIN FREQ"\n'
    for name, values in zip("AB", both, strict=False):
        values = np.asarray(values, complex)
        text += f'\n"TRACE: {name}"\n"FORMAT: LIN"\n\n"Frequency"\t"Data Trace Real"\t"Data Trace Imag"\n'
        text += table(F, values.real, values.imag, sep="\t")
    return text


CP, CS = Y.imag / W, -1.0 / (W * Z.imag)
FILES = {  # name of the file, its text
    "4294A, size and phase": ("a.txt", traces("IMPEDANCE MAG PHASE (DEG)", SIZE, ANGLE)),
    "4294A, Cp and D": ("a.txt", traces("CP D", CP, Y.real / Y.imag)),
    "4294A, complex": ("a.txt", traces("COMPLEX Z Y", Z, Y)),
    "E4990A": (
        "a.csv",
        "!Keysight Technologies,E4990A\n!Date: today\n\nBEGIN CH1_DATA\n"
        "Frequency(Hz), |Z|(Ohm)-data, theta-z(deg)-data\n"
        + table(F, SIZE, ANGLE, sep=", ")
        + "END\n",
    ),
    "Touchstone, Z": ("a.s1p", "! one port\n# Hz Z MA R 1\n" + table(F, SIZE, ANGLE, sep=" ")),
    "Touchstone, normalised Z": (
        "a.z1p",
        "# kHz Z RI R 50\n" + table(F / 1e3, Z.real / 50, Z.imag / 50, sep=" ", form="{:.12e}"),
    ),
    "Touchstone, S": (
        "a.s1p",
        "# Hz S RI R 50\n" + table(F, S.real, S.imag, sep=" ", form="{:.15e}"),
    ),
    "Touchstone, S in dB": (
        "a.s1p",
        "# Hz S DB R 50\n"
        + table(F, 20 * np.log10(np.abs(S)), np.degrees(np.angle(S)), sep=" ", form="{:.15e}"),
    ),
    "Cs and Rs": ("a.csv", "Frequency (Hz),Cs (F),Rs (Ohm)\n" + table(F, CS, Z.real)),
    "Cs and D": ("a.csv", "Frequency (Hz),Cs (F),D\n" + table(F, CS, -Z.real / Z.imag)),
    "Cp and D, decimal comma": (
        "a.csv",
        "FREQ[kHz];Cp[nF];D\n" + table(F / 1e3, CP * 1e9, Y.real / Y.imag, sep=";", sign=","),
    ),
    "Cp and Rp": ("a.csv", "f (Hz),Cp (pF),Rp (kohm)\n" + table(F, CP * 1e12, 1e-3 / Y.real)),
    "Cp and Q": ("a.csv", "f (Hz),Cp (pF),Q\n" + table(F, CP * 1e12, Y.imag / Y.real)),
    "G and B": (
        "a.csv",
        "f / Hz\tG / µS\tB / µS\n" + table(F, 1e6 * Y.real, 1e6 * Y.imag, sep="\t"),
    ),
    "VNA comments": (
        "a.csv",
        "! VNA\n! Stimulus(Hz), Z[Ohm] Re, Z[Ohm] Im\n" + table(F, Z.real, Z.imag),
    ),
    "several phases": (
        "a.csv",
        "Frequency(Hz),Return Loss(dB),Phase(deg),|Z|,Theta\n"
        + table(F, -20 * np.log10(np.abs(S)), np.degrees(np.angle(S)), SIZE, ANGLE),
    ),
    "Rs, Xs and |Z|": ("a.csv", "Freq (Hz),Rs,Xs,|Z|,SWR\n" + table(F, Z.real, Z.imag, SIZE, SIZE)),
    "Z' and -Z\"": ("a.csv", "Frequency (Hz),Z' (ohm),-Z'' (ohm)\n" + table(F, Z.real, -Z.imag)),
    "Zs' and Zs\"": (
        "a.txt",
        "Freq. [Hz]\tZs' [Ohms]\tZs'' [Ohms]\n" + table(F, Z.real, Z.imag, sep="\t"),
    ),
    "Z'(a) and Z''(b)": (
        "a.txt",
        "Freq(Hz)\tAmpl\tBias\tTime(Sec)\tZ'(a)\tZ''(b)\tGD\tErr\n"
        + table(F, 0 * F, 0 * F, F, Z.real, Z.imag, 0 * F, 0 * F, sep="\t"),
    ),
    "Re(Z) (ohm)": ("a.csv", "f (Hz),Re(Z) (ohm),-Im(Z) (ohm)\n" + table(F, Z.real, -Z.imag)),
    "Y' and Y\"": ("a.csv", "f (Hz),Y' (S),Y'' (S)\n" + table(F, Y.real, Y.imag)),
    "Re(Z) and -Im(Z)": (
        "a.csv",
        "freq/Hz,Re(Z)/Ohm,-Im(Z)/Ohm,|Z|/Ohm,Phase(Z)/deg\n"
        + table(F, Z.real, -Z.imag, SIZE, ANGLE),
    ),
    "Zreal and Zimag": (
        "a.csv",
        "Freq (Hz),Zreal (ohm),Zimag (ohm),Zmod (ohm),Zphz (°)\n"
        + table(F, Z.real, Z.imag, SIZE, ANGLE),
    ),
    "realz and imagz": (
        "a.csv",
        "frequency (Hz);realz (Ohm);imagz (Ohm)\n" + table(F, Z.real, Z.imag, sep=";"),
    ),
    "absz and phasez": (
        "a.csv",
        "frequency (Hz);absz (Ohm);phasez (rad)\n" + table(F, SIZE, np.radians(ANGLE), sep=";"),
    ),
    "Z and θ": ("a.csv", "FREQ[Hz],Z[Ω],θ[°]\n" + table(F, SIZE, ANGLE)),
    "-X": ("a.csv", "f (Hz),R (ohm),-X (ohm)\n" + table(F, Z.real, -Z.imag)),
    "reflection and impedance": (
        "a.csv",
        "freq[Hz],re:S11,im:S11,R (ohm),X (ohm)\n" + table(F, S.real, S.imag, Z.real, Z.imag),
    ),
}
MAGNITUDES = {
    "4294A, trace A alone": ("a.txt", traces("IMPEDANCE MAG PHASE (DEG)", SIZE)),
    "a table": ("a.csv", "Frequency (Hz),|Z| (ohm)\n" + table(F, SIZE)),
}
