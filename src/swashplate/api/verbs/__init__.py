"""What each verb is asked, one class each; `swashplate.cli.verbs` has their order. Nothing heavy is loaded here."""
