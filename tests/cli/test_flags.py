"""Python in messages becomes options on the command line."""

import pytest

from nearfar.cli.flags import flags, in_flags, with_flags


@pytest.mark.parametrize(
    ("code", "options"),
    [
        ("window", "--near"),
        ("black_level", "--black-level"),
        ("list_file", "--list"),
        ("offset='none'", "--offset none"),
        ("dropped=(3, 5)", "--drop 3x5"),
        ("side=0", "--side 0"),
        ("memory=2300000000", "--memory 2.3GB"),
        ("force=True", "--force"),
        ("resume=True, force=True", "--resume --force"),
        ("acquire(resume=True)", "acquire --resume"),
        ("with_checks(plan)", "--until"),
        ("shoot_again(numbers=range(2, 6))", "--reshoot 2-5"),
    ],
)
def test_what_python_is_on_the_command_line(code: str, options: str):
    assert in_flags(code) == options
    assert with_flags(f"try `{code}`, or `{code}`.") == f"try {options}, or {options}."


@pytest.mark.parametrize("code", ["q", "no(way=1)", "offset=q", "a b", "--near", "x.y", "3"])
def test_what_no_command_has_stays_without_its_backticks(code: str):
    assert in_flags(code) is None
    assert with_flags(f"the `{code}` of it") == f"the {code} of it"


def test_text_without_code_stays():
    assert with_flags("a file `b, and 'c'") == "a file `b, and 'c'"


def test_options_are_named_as_their_commands_declare_them():
    found = flags()
    assert found["as_json"] == "--json"
    assert found["browser"] == "--browser"
    assert "plan_file" not in found
