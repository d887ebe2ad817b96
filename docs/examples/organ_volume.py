"""Volume and area of objects, and how sure they are, as a table.

    organ_volume.py                                      # three phantoms
    organ_volume.py ct.nii.gz kidney=86,122,343 spleen=-30,150,360
"""

import sys

import surfseg


def measure(name, image, seed):
    try:
        surface = surfseg.segment(image, [seed])
    except surfseg.NoObject as error:
        print(f"{name:12} not found: {error}")
        return None
    certainty = surface.report.get("certainty", {})
    deviation = certainty.get("volume_deviation_mm3", float("nan")) / 1000
    verdict = surface.verdict["trust"] if surface.verdict else "-"
    print(f"{name:12} {surface.volume_ml:12.6g} {deviation:10.2g} {surface.area_cm2:12.6g}  {verdict}")
    return surface


def main(arguments):
    print(f"{'object':12} {'ml':>12} {'+-':>10} {'cm2':>12}  verdict")
    if not arguments:
        for kind, seed in (("ball", (0, 0, 0)), ("box", (0, 0, 0)), ("torus", (0.5, 0, 0))):
            measure(kind, surfseg.phantom(kind, size=48, noise=0.05), seed)
        return
    image = surfseg.read(arguments[0])
    for word in arguments[1:]:
        name, is_named, point = word.partition("=")
        if not is_named:
            sys.exit(f"organ_volume.py: expected NAME=X,Y,Z, such as kidney=86,122,343; got '{word}'")
        measure(name, image, [float(x) for x in point.split(",")])


if __name__ == "__main__":
    main(sys.argv[1:])
