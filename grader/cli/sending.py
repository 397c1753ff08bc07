"""``planmark send``."""

import os
import time
from collections import Counter
from pathlib import Path

from grader.cli import terminal
from grader.cli.app import progress
from grader.files import write_whole
from grader.lms.api.connection import Connection
from grader.lms.marks import json_text
from grader.lms.send import TOKEN, Sender, checked_site, checked_token, read_plan
from grader.options import SendOptions
from grader.tables.decisions import held
from grader.texts.spoken import fault
from reference.errors import counted


def send_export(file: Path, options: SendOptions) -> bool:
    """Send an export, or tell what would be sent; whether something is not sent."""
    plan, record = read_plan(file)
    site = checked_site(plan, options.site, allow_http=options.allow_http)
    if not options.yes:
        return _tell_open(Sender(plan, Connection(site), record), file, options)
    connection = Connection(site, checked_token(os.environ.get(TOKEN, "")), _wait)
    with held(record), progress() as tell:
        sender = Sender(plan, connection, record)
        sender.send(tell)
    recorded = f"; recorded in {record}" if sender.count else ""
    terminal.note(f"{counted(sender.count, 'call')} made at {site}{recorded}")
    for why in sender.failed:
        terminal.say(f"  {fault(why)}")
    if sender.left:
        terminal.say(f"  not tried: {', '.join(sender.left)}")
    if sender.rubric is not None and not any(call.student_id for call in plan.calls):
        path = record.with_name(f"{(file.parent if file.name == 'plan.json' else file).stem}-answer.json")
        write_whole(path, json_text(sender.rubric))
        terminal.note(f"next: export the marks with --criteria {path}")
    return bool(sender.failed or sender.left)


def _tell_open(sender: Sender, file: Path, options: SendOptions) -> bool:
    """Tell what would be sent, and how; whether there is anything."""
    groups = sender.pending()
    kinds = Counter(call.what for group in groups for call in group)
    calls = ", ".join(f"{count} {what}" for what, count in kinds.items())
    terminal.say(f"to send to {sender.plan.platform} at {sender.site}: {calls or 'nothing'}")
    if students := [group[0].student_id for group in groups if group[0].student_id]:
        terminal.say(f"  {counted(len(students), 'student')}: {', '.join(students)}")
    if known := len(sender.plan.calls) - kinds.total():
        terminal.say(f"  sent before and unchanged: {counted(known, 'call')}")
    if groups:
        site = ["--site", options.site] if options.site else []
        flags = [*site, *["--allow-http"] * options.allow_http, "--yes"]
        terminal.say("nothing was sent")
        terminal.tell_next("send", file, *flags, before=f"put the token into {TOKEN}, then ")
    return bool(groups)


def _wait(seconds: float) -> None:
    terminal.note(f"waiting {seconds:.0f} s for the platform")
    time.sleep(seconds)
