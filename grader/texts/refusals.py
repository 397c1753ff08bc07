"""The sentences of what the web application refuses, by their codes; all that they name is always known."""

from grader.language import N_

REFUSALS: dict[str, str] = {
    # Who asks
    "sign_in": N_("sign in first"),
    "wrong_name_or_password": N_("the name or the password is wrong"),
    "wrong_password": N_("the password is wrong"),
    "password_short": N_("the password must have %(least)s to 200 characters: a short sentence works well"),
    "password_common": N_("this password is easy to guess: use a short sentence of your own"),
    "code_needed": N_("give the code of your second factor, too"),
    "code_wrong": N_("the code is wrong or was used: wait for the next one"),
    "invitation": N_("this invitation is not valid any more: ask for a new one"),
    "invitation_old": N_("this invitation is too old: ask for a new one"),
    "name_taken": N_("somebody has the name %(name)s already: choose another"),
    "own_account": N_("you cannot remove your own account: another administrator must do it"),
    "token": N_("the token is not known"),
    "token_title": N_("choose another title"),
    "administrators": N_("only an administrator may do this"),
    "last_member": N_("somebody must stay: add a colleague first"),
    "form_old": N_("the page is out of date: load it again, and repeat what you did"),
    "too_often": N_("too many requests: wait a minute, then continue"),
    "link": N_("this link is not valid any more: ask your instructor for a new one"),
    "link_needed": N_("open the personal link that you were sent"),
    # What there is not
    "no_page": N_("there is no such page"),
    "no_publication": N_("there is no such assignment here"),
    "no_account": N_("there is no such account"),
    "no_claim": N_("there is no such claim"),
    "no_criterion": N_("there is no such criterion"),
    "no_file": N_("there is no such file"),
    "no_job": N_("there is no such job"),
    "no_link": N_("there is no such link"),
    "no_photo": N_("there is no such photo"),
    "no_platform": N_("there is no such platform"),
    "no_export": N_("there are exports for: %(known)s"),
    "no_receipt": N_("no sheet with this receipt was handed in here"),
    "no_request": N_("there is no such request"),
    "no_result": N_("there is no result: grade the class first"),
    "no_student": N_("there is no such student on the roster"),
    "no_term": N_("there is no such term"),
    "no_token": N_("there is no such token"),
    # Students
    "n_range": N_("give your number n, from %(first)s to %(last)s"),
    "position_range": N_("give the position, from %(first)s to %(last)s"),
    "busy": N_("the queue is full: try again in a few minutes"),
    "seconds": N_("your files took too long to process: send the next one in an hour"),
    "seconds_of_class": N_(
        "checking the photos of this class took too long: use your personal link, or try again in an hour"
    ),
    "pages_of_photo": N_("this file has %(pages)s pages: send %(most)s at most"),
    "pages": N_("too many pages: %(pages)s in this file, and %(left)s may still be handed in"),
    "sheets": N_("you have already handed in %(count)s sheets"),
    "no_sheets_now": N_("sheets are not handed in here now"),
    "deadline_over": N_("the deadline was %(at)s: nothing can be handed in any more; ask your instructor"),
    "not_open": N_("the self-check is not open now"),
    "not_released": N_("the feedback is not released yet"),
    "attempts_used": N_("no attempt is left (allowed: %(count)s)"),
    "file_type": N_("send a photo or scan: JPEG, PNG, TIFF, HEIC or PDF"),
    # Instructors
    "job_runs": N_("the class is being graded: cancel that, or wait for its end"),
    "assignment_missing": N_("no assignment is chosen yet"),
    "time_refused": N_("“%(given)s” is no date with a time: write 2026-12-01T23:59"),
    "file_unknown": N_("there is no file “%(name)s”"),
    "file_elsewhere": N_("%(file)s: “%(name)s” is not in its own folder; upload it beside it"),
    "file_exists": N_(
        "%(name)s: a file of this name is there already with other content; rename it, or replace it"
    ),
    "file_of_student": N_("%(name)s: a student has handed this in; choose another name"),
    "file_ending": N_("“%(name)s”: the file's name must end in one of %(endings)s"),
    "file_of_program": N_("“%(name)s”: a file that other programs leave behind, no submission"),
    "file_field": N_("no file is asked for as “%(name)s”; known are %(known)s"),
    "file_reserved": N_("upload the roster as the roster; decisions are made in the review"),
    # Learning platforms
    "lti_claimed": N_("somebody else has signed in as this student: your instructor will decide"),
    "lti_unchosen": N_("your instructor has not chosen yet what this activity shows"),
    "lti_choice": N_("open the activity on the platform again, then choose"),
    "lti_activity": N_("no activity of a platform shows this assignment"),
    "address_not_https": N_("%(field)s: write the address as https://NAME/PATH"),
    "address_inside": N_("%(field)s: this is an address within a network"),
    "login_unregistered": N_("the platform's login is refused: the platform is not registered here"),
    "login_for_nobody": N_("the platform's login is refused: it does not say for whom it is"),
    "launch_ended": N_("the platform does not launch: sign in there again"),
    "launch_unregistered": N_("the launch is refused: the platform is not registered here any more"),
    "launch_fault": N_("the launch is refused: %(where)s: %(fault)s"),
    "launch_no_message": N_("the launch is refused: it is no signed message"),
    "launch_unsigned": N_("the launch is refused: it is not signed as LTI asks for"),
    "launch_forged": N_("the launch is refused: the platform's key has not signed it"),
    "launch_late": N_(
        "the launch is refused: it was used already, or has waited too long: open the activity again"
    ),
    "launch_other_browser": N_(
        "the launch is refused: this browser has not begun it: allow its cookies, or open the"
        " activity in a new window"
    ),
    "launch_used": N_("the launch is refused: it was used already"),
    "launch_claims": N_("the launch is refused: %(claims)s is not right"),
    "launch_no_keys": N_(
        "the launch is refused: the platform's keys cannot be fetched: its key set address must give them"
    ),
    "launch_no_key": N_("the launch is refused: the platform has no such key"),
    # The review
    "review_host": N_("this address is not allowed here: open the address that planmark review printed"),
    "review_token": N_("the token is missing or wrong: open the address with its token"),
    "review_form": N_("only the review's own page may post"),
    "too_much_posted": N_("too much is sent at once"),
    "part_refused": N_("this part of the page cannot be shown"),
    "student_unknown": N_("there is no student %(name)s in this class any more"),
    "criterion_unknown": N_("%(student)s has no criterion %(name)s"),
    "answer_empty": N_("say whose the page is, or turn it, or give its corners"),
    "no_answer": N_("“%(given)s” is no answer"),
    "second_own": N_("another person must have decided this before you mark it a second time"),
    "comment_changed": N_("other decisions have this comment by now: look at it again, then change it"),
    "no_number": N_("“%(given)s” is no number that can be used here"),
    "no_whole_number": N_("%(given)s is no whole number"),
    # Around every request
    "other_host": N_("this address is not served here: open the server's own address"),
    "too_large": N_("larger than %(most)s MB: send a smaller file"),
    "too_slow_body": N_("it came too slowly: send it again, where the network is better"),
    "crowded": N_("too many files are being sent: wait a minute, then send it again"),
}
