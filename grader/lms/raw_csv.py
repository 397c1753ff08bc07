"""CSV files changed in single cells, everything else kept to the byte."""

from dataclasses import dataclass, field

from reference.errors import InputFileError

_QUOTE = '"'


@dataclass(slots=True)
class RawTable:
    """Cells as they stand in the file, quotes included, with what stands between them.

    Attributes
    ----------
    mark : a byte order mark, or nothing
    rows : raw cells
    ends : each row's line end; nothing after the last where the file has none
    """

    mark: str
    delimiter: str
    rows: list[list[str]] = field(default_factory=list)
    ends: list[str] = field(default_factory=list)

    def value(self, row: int, column: int) -> str:
        """A cell's meaning."""
        return unquoted(self.rows[row][column])

    def put(self, row: int, column: int, text: str) -> None:
        """Change one cell; one that already means this text stays as it is written."""
        if self.value(row, column) != text:
            self.rows[row][column] = quoted(text, self.delimiter)

    def text(self) -> str:
        """The whole file."""
        lines = (self.delimiter.join(row) + end for row, end in zip(self.rows, self.ends, strict=True))
        return self.mark + "".join(lines)


def unquoted(cell: str) -> str:
    """What a raw cell means."""
    if len(cell) >= 2 and cell.startswith(_QUOTE) and cell.endswith(_QUOTE):
        return cell[1:-1].replace(_QUOTE * 2, _QUOTE)
    return cell


def quoted(text: str, delimiter: str) -> str:
    """A raw cell that means this text."""
    if any(mark in text for mark in (delimiter, _QUOTE, "\n", "\r")) or text != text.strip():
        return _QUOTE + text.replace(_QUOTE, _QUOTE * 2) + _QUOTE
    return text


def parse(data: bytes, file: str, delimiter: str = ",") -> RawTable:
    """Split a file into raw cells.

    Raises InputFileError for text that is not UTF-8, for an open quote and for text after a closed one.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputFileError(
            "not_utf8",
            f"{file}: is not UTF-8 text (byte {error.start}); download it again and do not resave it",
        ) from error
    mark = "\ufeff" if text.startswith("\ufeff") else ""
    table = RawTable(mark, delimiter)
    at = len(mark)
    row: list[str] = []
    while at < len(text):
        end = _cell_end(text, at, delimiter, file, len(table.rows) + 1)
        row.append(text[at:end])
        if end < len(text) and text[end] == delimiter:
            at = end + 1
            if at < len(text):
                continue
            row.append("")
        line_end = _line_end(text, end) if end < len(text) and text[end] != delimiter else ""
        table.rows.append(row)
        table.ends.append(line_end)
        row, at = [], max(end, at) + len(line_end)
    return table


def _cell_end(text: str, at: int, delimiter: str, file: str, line: int) -> int:
    """Where the cell that begins at `at` ends."""
    if text[at] != _QUOTE:
        while at < len(text) and text[at] != delimiter and text[at] not in "\r\n":
            at += 1
        return at
    close = at + 1
    while True:
        close = text.find(_QUOTE, close)
        if close < 0:
            raise InputFileError("quote_open", f"{file}, row {line}: a quote is opened and never closed")
        if text[close + 1 : close + 2] != _QUOTE:
            break
        close += 2
    if close + 1 < len(text) and text[close + 1] != delimiter and text[close + 1] not in "\r\n":
        raise InputFileError("quote_broken", f"{file}, row {line}: text follows a closing quote")
    return close + 1


def _line_end(text: str, at: int) -> str:
    return "\r\n" if text.startswith("\r\n", at) else text[at]
