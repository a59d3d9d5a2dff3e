"""Markdown tables and short numbers, for the scripts that fill pages."""


def table(head, rows):
    lines = ['| ' + ' | '.join(head) + ' |', '|---' * len(head) + '|']
    lines += ['| ' + ' | '.join(row) + ' |' for row in rows]
    return '\n'.join(lines)


def figure(value, unit=''):
    """Three digits."""
    if value is None:
        return ''
    if abs(value) >= 1000:
        return f'{value:.0f}{unit}'
    return f'{value:#.3g}'.rstrip('.') + unit
