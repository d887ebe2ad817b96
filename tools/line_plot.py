"""Curves with a legend, as the text of an SVG file."""

COLOURS = ["#1b6ca8", "#d1495b", "#2e8b57", "#8d6a9f", "#e08e1b", "#555555", "#17a2a2", "#a0522d", "#b5a100"]
WIDTH, HEIGHT, LEFT, TOP = 430, 300, 60, 20


def line_plot(curves, label, x_ticks, y_ticks, scale=lambda value: value):
    """curves: {name: [(x, y), ...]}; ticks: [(value, text), ...], the first and last are the ends of an axis; scale: of both axes, math.log10 or none."""
    def along(ticks, value):
        first, last = scale(ticks[0][0]), scale(ticks[-1][0])
        return (scale(value) - first) / max(last - first, 1e-9)

    def at(x, y):
        return LEFT + WIDTH * along(x_ticks, x), TOP + HEIGHT * (1 - along(y_ticks, y))

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{LEFT + WIDTH + 350}" height="{TOP + HEIGHT + 50}" '
           'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="white"/>']
    for value, text in y_ticks:
        y = at(x_ticks[0][0], value)[1]
        out.append(f'<line x1="{LEFT}" x2="{LEFT + WIDTH}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>'
                   f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{text}</text>')
    for value, text in x_ticks:
        x = at(value, y_ticks[0][0])[0]
        out.append(f'<text x="{x:.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{text}</text>')
    out.append(f'<text x="{LEFT + WIDTH / 2}" y="{TOP + HEIGHT + 38}" text-anchor="middle">{label}</text>')
    for i, (name, points) in enumerate(curves.items()):
        colour, key = COLOURS[i % len(COLOURS)], TOP + 12 + 20 * i
        points = [at(x, y) for x, y in points]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        out += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in points]
        out.append(f'<line x1="{LEFT + WIDTH + 20}" x2="{LEFT + WIDTH + 40}" y1="{key}" y2="{key}" '
                   f'stroke="{colour}" stroke-width="2"/><text x="{LEFT + WIDTH + 46}" y="{key + 4}">{name}</text>')
    return "\n".join(out) + "\n</svg>\n"
