"""``planmark send``."""

import os
import time
from collections import Counter
from pathlib import Path

from grader.cli import terminal
from grader.cli.app import progress
from grader.cli.terminal import gettext
from grader.files import write_whole
from grader.language import N_
from grader.lms.api.connection import Connection
from grader.lms.marks import json_text
from grader.lms.send import TOKEN, Sender, checked_site, checked_token, read_plan
from grader.options import SendOptions
from grader.tables.decisions import held
from grader.texts.spoken import fault


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
    told = gettext("calls made at %(site)s: %(count)s", site=site, count=sender.count)
    recorded = gettext("; recorded in %(file)s", file=record) if sender.count else ""
    terminal.note(told + recorded)
    for why in sender.failed:
        terminal.say(f"  {fault(why, terminal.speaker())}")
    if sender.left:
        terminal.say("  " + gettext("not tried: %(names)s", names=", ".join(sender.left)))
    if sender.rubric is not None and not any(call.student_id for call in plan.calls):
        path = record.with_name(f"{(file.parent if file.name == 'plan.json' else file).stem}-answer.json")
        write_whole(path, json_text(sender.rubric))
        terminal.note(gettext("next: export the marks with --criteria %(file)s", file=path))
    return bool(sender.failed or sender.left)


def _tell_open(sender: Sender, file: Path, options: SendOptions) -> bool:
    """Tell what would be sent, and how; whether there is anything."""
    groups = sender.pending()
    kinds = Counter(call.what for group in groups for call in group)
    calls = ", ".join(f"{count} {what}" for what, count in kinds.items())
    known = {"platform": sender.plan.platform, "site": sender.site, "calls": calls or gettext("nothing")}
    terminal.say(gettext("to send to %(platform)s at %(site)s: %(calls)s", **known))
    if students := [group[0].student_id for group in groups if group[0].student_id]:
        told = N_("students (%(count)s): %(names)s")
        terminal.say("  " + gettext(told, count=len(students), names=", ".join(students)))
    if same := len(sender.plan.calls) - kinds.total():
        terminal.say("  " + gettext("calls sent before and unchanged: %(count)s", count=same))
    if groups:
        site = ["--site", options.site] if options.site else []
        flags = [*site, *["--allow-http"] * options.allow_http, "--yes"]
        terminal.say(gettext("nothing was sent"))
        before = gettext("put the token into %(name)s, then", name=TOKEN)
        terminal.tell_next("send", file, *flags, before=f"{before} %(command)s")
    return bool(groups)


def _wait(seconds: float) -> None:
    terminal.note(gettext("waiting %(seconds).0f s for the platform", seconds=seconds))
    time.sleep(seconds)
